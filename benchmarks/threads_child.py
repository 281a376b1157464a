"""One stage with a number of threads: a process of its own, run by benchmarks.threads; prints one line of JSON."""

import argparse
import hashlib
import json
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import ThreadpoolController

from benchmarks.deformable_wall import wall_scene
from benchmarks.generated import disk_box, running_bond
from benchmarks.report import guarded
from benchmarks.scenes import engine_scene
from mechanics.arrays import Array, Ints
from mechanics.contact.contacts import take
from mechanics.delassus import rigid
from mechanics.delassus.assembly import rigid_delassus
from mechanics.delassus.elimination import elimination
from mechanics.dynamics.contact_search import detector
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import Model, build_model
from mechanics.planar.contacts import PlanarDetector
from mechanics.planar.delassus import PlanarDelassus
from mechanics.planar.model import build_planar_model
from mechanics.problem.problem import GaussSeidel
from mechanics.scene.scene import Start
from mechanics.scene.state import State
from mechanics.solvers._kernels.body_cholesky import panels_of, postorder
from mechanics.solvers._kernels.body_parts import parts_of
from mechanics.solvers.first_order.body_factors import factorise
from mechanics.stones.meshing.elements import Element
from moma.errors import SolverError

__all__ = ["STAGES", "main"]

Result = Array | Ints

# sweeps in one measurement
_SWEEPS = 50
# velocities that gravity gives in a step [m/s]
_FALL = 9.81e-3


@dataclass(frozen=True)
class _Stage:
    """Work that is timed, repeatedly.

    Attributes
    ----------
    contacts : of the scene
    prepare : returns what is timed, which returns the arrays that have to have the same bits
    """

    contacts: int
    prepare: Callable[[], Callable[[], tuple[Result, ...]]]


def main() -> None:
    """`threads_child.py STAGE SIZE THREADS REPEATS`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("stage", choices=list(STAGES))
    parser.add_argument("size", type=int)
    parser.add_argument("threads", type=int)
    parser.add_argument("repeats", type=int)
    options = parser.parse_args()
    make = STAGES[options.stage]
    with ThreadpoolController().limit(limits=1, user_api="blas"):
        stage = make(options.size, options.threads)
        arrays = stage.prepare()()  # compiles
        wall, cpu = [], []
        for _ in range(options.repeats):
            run = stage.prepare()
            begun = time.perf_counter(), time.process_time()
            arrays = run()
            wall.append(time.perf_counter() - begun[0])
            cpu.append(time.process_time() - begun[1])
    digest = hashlib.sha256(b"".join(np.ascontiguousarray(one).tobytes() for one in arrays)).hexdigest()
    row = {"contacts": stage.contacts, "wall": min(wall), "cpu": min(cpu), "digest": digest}
    json.dump(row, sys.stdout)


def _swept(sweep: GaussSeidel, shape: tuple[int, ...]) -> Callable[[], tuple[Result, ...]]:
    impulse = np.zeros(shape)

    def run() -> tuple[Result, ...]:
        sweep(impulse, _SWEEPS)
        return (impulse,)

    return run


def _plane(size: int, threads: int) -> _Stage:
    """Sweeps of size × size disks."""
    model, state = build_planar_model(disk_box(size, size))
    contacts = PlanarDetector(model)(state)
    operator = PlanarDelassus(contacts.bodies, contacts.normal, contacts.lever, model.inertia, threads)
    fall = np.zeros((len(model.fixed), 3))
    fall[~model.fixed, 1] = -_FALL
    shift, none = operator.relative_velocity(fall), np.zeros(len(contacts))
    sweep = operator.gauss_seidel(shift, none + 0.3, none)
    return _Stage(len(contacts), lambda: _swept(sweep, shift.shape))


def _wall(size: int, threads: int) -> tuple[Model, State]:
    scene = engine_scene(running_bond(size, size), 1e-3, 0.5, 1e-30, _SWEEPS, sweeping=True)
    return build_model(replace(scene, solver=replace(scene.solver, threads=threads)))


def _space(size: int, threads: int) -> _Stage:
    """Sweeps of a wall of size × size bricks, none asleep."""
    model, state = _wall(size, threads)
    contacts = detector(model)(state, np.zeros(len(model.mass)))
    plan = rigid.schedule(contacts.bodies, model.inertia.moving)
    operator = rigid_delassus(model, state, take(contacts, plan.order), plan)
    fall = np.zeros((len(model.mass), 6))
    fall[model.inertia.moving, 2] = -_FALL
    shift, none = operator.relative_velocity(fall), np.zeros(len(contacts))
    rigid._CALM = -1.0
    sweep = operator.gauss_seidel(shift, none + 0.5, none)
    return _Stage(len(contacts), lambda: _swept(sweep, shift.shape))


def _detection(size: int, threads: int) -> _Stage:
    """Contacts of a wall of size × size bricks, found for the first time."""
    model, state = _wall(size, threads)
    reach = np.zeros(len(model.mass))

    def prepare() -> Callable[[], tuple[Result, ...]]:
        find = detector(model)

        def run() -> tuple[Result, ...]:
            contacts = find(state, reach)
            return contacts.key, contacts.frame, contacts.arm

        return run

    return _Stage(len(detector(model)(state, reach)), prepare)


def _elastic(size: int, threads: int) -> Simulation:
    """A deformable wall of size × size bricks, of which a step is one iteration."""
    scene = wall_scene(size, size, Element.HEX8, Start.REST, base=False)
    scene = replace(scene, solver=replace(scene.solver, threads=threads, max_iterations=1))
    return Simulation(*build_model(scene))


def _factorisation(size: int, threads: int) -> _Stage:
    """W + Θ of that wall, whose order of elimination is known."""
    problem = _elastic(size, threads).step().problem
    form, load = problem.form("benchmark"), problem.u_free.ravel()
    theta = np.tile(problem.delassus.scale * np.eye(3), (len(problem.friction), 1, 1))

    def run() -> tuple[Result, ...]:
        return (form.shifted(theta)(load),)

    return _Stage(len(theta), lambda: run)


def _first_step(size: int, threads: int) -> _Stage:
    """The first step of that wall: detection, assembly, the order of elimination, and factorisation."""

    def prepare() -> Callable[[], tuple[Result, ...]]:
        simulation = _elastic(size, threads)

        def run() -> tuple[Result, ...]:
            return (simulation.step().solution.impulse,)

        return run

    return _Stage(len(_elastic(size, threads).step().contacts), prepare)


def _bodies(size: int, threads: int) -> _Stage:
    """Factors of single precision of size × size bodies in running bond, each of which touches six."""
    body = np.arange(size * size).reshape(size, size)
    pairs = [(body[1:], body[:-1]), (body[:, 1:], body[:, :-1]), (body[1:, 1:], body[:-1, :-1])]
    touching = np.concatenate([np.column_stack([one.ravel(), other.ravel()]) for one, other in pairs])
    place = np.column_stack([*np.divmod(body.ravel(), size), np.zeros(size * size)]).astype(float)
    rank = elimination(touching, body.ravel(), place)
    rank = postorder(rank[touching], size * size)[rank]
    panels = panels_of(rank[touching], size * size, 0.2, 6)
    parts = parts_of(panels, True)
    # fill is part of the matrix too, so that any small numbers do
    matrix = 1e-4 * np.random.default_rng(1).random(panels.start[-1], dtype=np.float32)
    for s, width in enumerate(6 * np.diff(panels.body)):
        matrix[panels.start[s] : panels.start[s + 1]].reshape(width, -1)[:, :width] += np.eye(width)

    def prepare() -> Callable[[], tuple[Result, ...]]:
        value = matrix.copy()

        def run() -> tuple[Result, ...]:
            if not factorise(panels, value, parts, threads):
                raise SolverError("a matrix is not positive definite", where="benchmark")
            return (value,)

        return run

    return _Stage(len(touching), prepare)


STAGES: Mapping[str, Callable[[int, int], _Stage]] = {
    "sweeps in the plane": _plane,
    "sweeps in space": _space,
    "detection": _detection,
    "elastic factorisation": _factorisation,
    "elastic first step": _first_step,
    "factors of bodies": _bodies,
}


if __name__ == "__main__":
    guarded(main)
