"""MOMA on one scene: a process of its own, run by benchmarks.lmgc90, which leaves one .npz file behind."""

import argparse
import time
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.scenes import engine_scene, read_scene
from mechanics.arrays import Array
from mechanics.contact.contacts import gaps, material_points
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.step import Step
from mechanics.model.model import build_model
from mechanics.scene.loads.load import Loads
from mechanics.scene.scene import Scene

__all__ = ["main"]


def main() -> None:
    """Run once untimed, then again, and write cpu, sweeps, motion and the contacts of some steps to OUT."""
    options = _options()
    blocks = read_scene(Path(options.scene))
    scene = _scene(
        engine_scene(blocks, options.step, options.theta, options.tolerance, options.sweeps), options
    )
    _warm_up(scene, options)
    simulation = _simulation(scene, options.fresh)
    state = simulation.state
    place = [(state.centre, state.rotation.transpose(0, 2, 1))]
    cpu, sweeps, contacts, solved, compliant, kept = [], [], [], [], [], {}
    for n in range(1, options.steps + 1):
        start = time.process_time()
        step = simulation.step()
        cpu.append(time.process_time() - start)
        sweeps.append(step.solution.iterations)
        contacts.append(len(step.contacts.key))
        solved.append(step.solution.converged)
        compliant.append(step.problem.delassus.joint_compliance is not None)
        place.append((step.after.centre, step.after.rotation.transpose(0, 2, 1)))
        if n == 1 or n > options.steps - options.keep:
            kept[n] = _contacts(step, options.step)
    centre, frame = (np.array(one) for one in zip(*place, strict=True))
    flat = {f"{key}_{n}": value for n, contacts in kept.items() for key, value in contacts.items()}
    program = f"moma-masonry {version('moma-masonry')}"
    np.savez(
        options.out,
        program=program,
        cpu=cpu,
        sweeps=sweeps,
        contacts=contacts,
        solved=solved,
        compliant=compliant,
        centre=centre,
        frame=frame,
        kept=list(kept),
        **flat,
    )


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene")
    parser.add_argument("out")
    parser.add_argument("--steps", type=int, required=True)
    parser.add_argument("--keep", type=int, required=True)
    parser.add_argument("--step", type=float, required=True)
    parser.add_argument("--theta", type=float, required=True)
    parser.add_argument("--tolerance", type=float, required=True)
    parser.add_argument("--sweeps", type=int, required=True)
    parser.add_argument("--fresh", action="store_true", help="find the contacts anew in every step")
    parser.add_argument(
        "--velocity-tolerance", type=float, help="of each step; without it the engine's default"
    )
    parser.add_argument(
        "--motion-error", type=float, help="of the whole run; without it both tolerances hold [m]"
    )
    parser.add_argument("--gravity", help=".npy (steps, 3): gravity in each step, in its middle [m/s²]")
    return parser.parse_args()


@dataclass(frozen=True)
class _GravityOfSteps:
    """Gravity given step by step.

    Attributes
    ----------
    values : (n, 3) in the middle of each step [m/s²]
    step : h [s]
    """

    values: Array
    step: float

    @property
    def until(self) -> float:
        """End of the table [s]."""
        return len(self.values) * self.step

    def __call__(self, time: float, gravity: Array) -> Array:
        """Return gravity (3,) in the step that contains `time` [m/s²]; that of the scene does not count."""
        row: Array = self.values[min(int(time / self.step), len(self.values) - 1)]
        return row


def _scene(scene: Scene, options: argparse.Namespace) -> Scene:
    """The scene with what the options say of its loads, duration and solver."""
    scene = replace(
        scene,
        time=replace(scene.time, duration=options.steps * options.step),
        solver=replace(scene.solver, motion_error=options.motion_error),
    )
    if options.velocity_tolerance is not None:
        scene = replace(scene, solver=replace(scene.solver, velocity_tolerance=options.velocity_tolerance))
    if options.gravity is None:
        return scene
    return replace(scene, loads=Loads((_GravityOfSteps(np.load(options.gravity), options.step),)))


def _simulation(scene: Scene, fresh: bool = False) -> Simulation:
    return Simulation(*build_model(scene), fresh_contacts=fresh)


def _warm_up(scene: Scene, options: argparse.Namespace) -> None:
    """Run the same steps: every kernel that any of them needs is compiled, or loaded, before the clock runs."""
    simulation = _simulation(scene, options.fresh)
    for _ in range(options.steps):
        simulation.step()


def _contacts(step: Step, h: float) -> dict[str, Any]:
    return {
        "body": step.contacts.bodies,
        "point": material_points(step.contacts, step.predicted).mean(axis=1),
        "frame": step.contacts.frame,
        "gap": gaps(step.contacts, step.predicted),
        "force": step.impulse / h,
    }


if __name__ == "__main__":
    main()
