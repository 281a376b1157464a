"""MOMA on one scene: a process of its own, run by benchmarks.lmgc90, which leaves one .npz file behind."""

import argparse
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.scenes import engine_scene, read_scene
from mechanics.contact.contacts import gaps, material_points
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.step import Step
from mechanics.model.model import build_model
from mechanics.scene.scene import Scene

__all__ = ["main"]


def main() -> None:
    """Run once untimed, then again, and write cpu, sweeps, motion and the contacts of some steps to OUT."""
    options = _options()
    blocks = read_scene(Path(options.scene))
    scene = engine_scene(blocks, options.step, options.theta, options.tolerance, options.sweeps)
    _warm_up(scene, options)
    simulation = _simulation(scene, options.fresh)
    state = simulation.state
    place = [(state.centre, state.rotation.transpose(0, 2, 1))]
    cpu, sweeps, kept = [], [], {}
    for n in range(1, options.steps + 1):
        start = time.process_time()
        step = simulation.step()
        cpu.append(time.process_time() - start)
        sweeps.append(step.solution.iterations)
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
    return parser.parse_args()


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
