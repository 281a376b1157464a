"""Tradeoff study: the user's own scene at many settings, each compared with the finest of them."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from archmodel.database.session import open_database
from ground.errors import UsageError
from ground.toml.schema import nearest
from mechanics.dynamics.progress import Listener, Progress, silent
from mechanics.model.model import build_model
from mechanics.results.forecast.plan import loose_blocks
from mechanics.scene.scene import Fidelity
from pipelines.draw.elevations.sheet import require_figures
from pipelines.results.quantities import QUANTITIES
from pipelines.run.assemble import assemble
from pipelines.run.soundness import caution_of, problems_of, refuse_unsound
from pipelines.scene.file import read_scene
from pipelines.scene.stages import refuse_stages
from pipelines.tradeoff.grid import grid
from pipelines.tradeoff.memory import machine_memory
from pipelines.tradeoff.report import Goal, study_record, write_study
from pipelines.tradeoff.scheduler import Limits, carry_out
from pipelines.tradeoff.store import Store, study_key
from pipelines.tradeoff.worker import Job
from pipelines.tuning.overlay import typical_width
from survey.conventions import FEW

_STRESS = "von_mises"  # names of quantities with this in them are stresses
_MEMORY_SHARE = 0.8  # share of the memory of the machine that runs may take together [-]


@dataclass(frozen=True)
class Asked:
    """Request of a study.

    Attributes
    ----------
    budget : time of all runs [s]
    jobs : runs at a time
    error : below which a setting is recommended [-]
    quantity : of this error; None: von_mises_p99 if a stone deforms, support_reactions if none does
    accept_unsound : study a scene that `check_scene` finds unsound all the same; the study says so then
    """

    budget: float = 600.0
    jobs: int = 1
    error: float = FEW
    quantity: str | None = None
    accept_unsound: bool = False

    def __post_init__(self) -> None:
        if self.quantity is not None and self.quantity not in QUANTITIES:
            raise UsageError(
                f"unknown quantity {self.quantity!r}", where="--of", remedy=nearest(self.quantity, QUANTITIES)
            )
        cores = os.cpu_count() or 1
        if not 1 <= self.jobs <= cores:
            raise UsageError(f"{self.jobs} runs at a time", where="--jobs", remedy=f"give 1 to {cores}")
        for name, value in (("--budget", self.budget), ("--error", self.error)):
            if not 0.0 < value < float("inf"):
                raise UsageError(f"{value:g} is not above zero", where=name, remedy="give a positive number")


@dataclass(frozen=True)
class TradeReport:
    """Result of a study.

    Attributes
    ----------
    folder : of the study
    record : contents of trade.json
    """

    folder: Path
    record: dict[str, Any]


def run_trade(
    path: str | Path, url: str, folder: str | Path, asked: Asked, progress: Listener = silent
) -> TradeReport:
    """Run a scene at many settings; measure the cost of each and its difference from the finest.

    Parameters
    ----------
    path : scene file
    url : of the database
    folder : of the study; runs that it holds already are not repeated
    asked : budget, and criterion of the recommendation
    progress : called at every run

    Raises
    ------
    UsageError : the folder holds other files
    UnsoundSceneError : the scene has problems that `check_scene` reports, and they are not accepted
    SceneError, GeometryError, DatabaseError : see `pipelines.run.assemble`
    """
    require_figures()
    scene = read_scene(path)
    refuse_stages(scene.stages, scene.document, "moma trade")
    progress(Progress("blocks", 0, None, "reading the stones and closing their joints"))
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        assembly = assemble(scene, session)
    problems = problems_of(scene, assembly, loose_blocks(*build_model(assembly.scene)))
    if not asked.accept_unsound:
        refuse_unsound(problems, str(path))
    width = typical_width(assembly.models)
    blocks = assembly.scene.blocks
    soft = any(block.fidelity is Fidelity.DEFORMABLE for block in blocks)
    quantity = asked.quantity or ("von_mises_p99" if soft else "support_reactions")
    settings = grid(scene, blocks, width, stress=_STRESS in quantity)
    store = Store(Path(folder), study_key(scene, assembly))
    store.prepare()
    limits = Limits(
        asked.budget, asked.jobs, _MEMORY_SHARE * machine_memory(), quantity, scene.solver.threads
    )
    job = Job(scene.text, str(path), url, width)
    forecast, left = carry_out(job, settings, store, limits, progress)
    goal = Goal(scene.name, quantity, asked.error, width)
    record = study_record(goal, forecast, left, limits) | {
        "cautions": [caution_of(problems)] if problems else []
    }
    write_study(store, record)
    return TradeReport(store.folder, record)
