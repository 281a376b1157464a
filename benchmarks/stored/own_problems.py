"""Contact problems of rigid scenes, written as stored ones."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.sparse import block_diag, bsr_array

from benchmarks.generated import rigid_scenes
from benchmarks.scenes import BlockScene, engine_scene
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.problem.problem import ContactProblem

__all__ = ["write_own_problems"]


# scene, angle by which gravity is tilted along it [°], step whose problem is kept
_PROBLEMS = (
    ("column_10", 0.0, 1),
    ("column_50", 0.0, 1),
    ("arch_15", 0.0, 1),
    ("arch_15", 30.0, 1),
    ("arch_15", 30.0, 40),
    ("arch_45", 0.0, 1),
    ("arch_45", 25.0, 10),
    ("wall_10x10", 0.0, 1),
)
_STEP, _THETA, _TOLERANCE, _ITERATIONS = 1e-3, 0.5, 1e-6, 2000


def write_own_problems(folder: Path) -> None:
    """Write one .npz for each, named after the scene, the tilt and the step."""
    scenes = {scene.name: scene for scene in rigid_scenes()}
    for name, tilt, step in _PROBLEMS:
        _write(_problem(scenes[name], tilt, step), folder / f"{name} at {tilt:.0f}°, step {step}.npz")


def _problem(scene: BlockScene, tilt: float, step: int) -> ContactProblem:
    engine = engine_scene(scene, _STEP, _THETA, _TOLERANCE, _ITERATIONS)
    g, angle = scene.gravity, np.radians(tilt)
    tilted = replace(engine, gravity=(float(g * np.sin(angle)), 0.0, float(-g * np.cos(angle))))
    simulation = Simulation(*build_model(tilted))
    for _ in range(step - 1):
        simulation.step()
    return simulation.step().problem


def _write(problem: ContactProblem, path: Path) -> None:
    """Write W in block-sparse rows, q with the bias in it, and μ."""
    form = problem.delassus.form
    assert form is not None
    lift, mass = form.lift, form.inertia  # type: ignore[attr-defined]
    # six unknowns of each body stand together
    blocks = [
        np.linalg.inv(mass[6 * k : 6 * k + 6, 6 * k : 6 * k + 6].toarray()) for k in range(mass.shape[0] // 6)
    ]
    w = bsr_array(lift.T @ block_diag(blocks, format="csc") @ lift, blocksize=(3, 3))
    w.sort_indices()
    np.savez(
        path,
        data=w.data,
        indices=w.indices,
        indptr=w.indptr,
        q=problem.biased.ravel(),
        mu=problem.friction,
        nc=len(problem.friction),
    )
