"""One run of a tradeoff study, the work of a process that no other run shares: its peak memory is that of the run."""

import time
from dataclasses import dataclass, field
from typing import Any

from archmodel.database.session import open_database
from ground.errors import MomaError
from mechanics.results.result import Result
from mechanics.simulate import simulate
from pipelines.results.quantities import quantities
from pipelines.run.assemble import assemble
from pipelines.scene.file import SceneFile, parse_scene
from pipelines.tradeoff.memory import peak_memory
from pipelines.tuning.overlay import Overlay, overlaid

SHORT = 5.0
"""CPU time below which work is done twice, since the first time includes loading compiled kernels [s]."""


@dataclass(frozen=True)
class Job:
    """Input of one run.

    Attributes
    ----------
    text, path : of the scene file; the path is for messages and for files beside it
    url : of the database
    width : typical smallest width of the stones [m]
    overlay : settings that replace those of the scene
    """

    text: str
    path: str
    url: str
    width: float
    overlay: Overlay = field(default_factory=Overlay)


def measured(job: Job) -> dict[str, Any]:
    """Run a scene, twice if that is short, and return its cost and results; of a run that fails its `reason`."""
    program = peak_memory()
    try:
        scene = overlaid(parse_scene(job.text, job.path), job.overlay, job.width)
        for _ in range(2):
            cpu, wall = time.process_time(), time.perf_counter()
            result = _simulated(scene, job.url)
            cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
            if cpu > SHORT:
                break
    except MomaError as error:
        return {"reason": " ".join(str(error).split())}
    except Exception as error:  # a setting that breaks is a row with its reason
        return {"reason": f"{type(error).__name__}: {error}"}
    return {
        "cpu": cpu,
        "wall": wall,
        "memory": peak_memory(),
        "program_memory": program,
        "nodes": sum(len(body.reference) for body in result.bodies if body.element is not None),
        "contacts": len(result.contacts.gap),
        "steps": result.steps,
        "unconverged_steps": result.errors.unconverged_steps,
        "solver": str(next(iter(result.solvers), "")),
        "stages": dict(result.wall_time),
        "quantities": quantities(result),
    }


def _simulated(scene: SceneFile, url: str) -> Result:
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        assembly = assemble(scene, session)
    return simulate(assembly.scene)
