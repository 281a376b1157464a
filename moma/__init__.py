"""MOMA: from a stone-by-stone survey of a historic building to a mechanical simulation of it.

Each name of `__all__` is loaded when it is first used. A survey goes into a database, which is then asked for stones::

    >>> import moma
    >>> from tempfile import TemporaryDirectory
    >>> folder = TemporaryDirectory()
    >>> url = f"sqlite:///{folder.name}/moma.db"
    >>> files = moma.ingest(["data/samples/window/window.moma"], url).files
    >>> with moma.open_database(url) as database, database.session(read_only=True) as session:
    ...     [stone.code for stone in moma.find(session, "voussoir", ["depth < 0.44", "volume > 0.065"])]
    ['V1', 'V7']
    >>> folder.cleanup()

`run_scene` simulates stones of a database as a scene file says. Without a database, a scene is made of blocks::

    >>> import numpy as np
    >>> corners = np.array([(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], dtype=float)
    >>> faces = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
    >>> limestone = moma.Material("limestone", density=2000.0, young=1e10, poisson=0.2)
    >>> base = moma.Block("base", corners, faces, limestone, moma.Fidelity.FIXED)
    >>> stone = moma.Block("stone", corners + [0.0, 0.0, 1.0], faces, limestone)
    >>> result = moma.simulate(moma.Scene("two blocks", (base, stone)))
    >>> print(f"{result.outcome}: the base carries {result.reaction:.1f} N")
    equilibrium: the base carries 19620.0 N
"""

from importlib import import_module
from typing import TYPE_CHECKING

from ground.errors import MomaError as MomaError

if TYPE_CHECKING:
    from archmodel.database.session import open_database as open_database
    from archmodel.describe.history import history as history
    from archmodel.describe.trace import trace as trace
    from archmodel.query.api import find as find
    from archmodel.query.api import find_rows as find_rows
    from archmodel.relations.load_paths import load_path as load_path
    from mechanics.results.result import Result as Result
    from mechanics.scene.scene import Block as Block
    from mechanics.scene.scene import Fidelity as Fidelity
    from mechanics.scene.scene import Scene as Scene
    from mechanics.scene.stages import Stage as Stage
    from mechanics.simulate import simulate as simulate
    from mechanics.simulate import simulate_stages as simulate_stages
    from mechanics.stones.materials import Material as Material
    from pipelines.assess.assess import assess as assess
    from pipelines.ingest.ingest import ingest as ingest
    from pipelines.record.export.compas_solve import moma_solve as moma_solve
    from pipelines.record.record import record as record
    from pipelines.reports.survey.report import report_surveys as report_surveys
    from pipelines.run.assemble import assemble as assemble
    from pipelines.run.run import run_scene as run_scene
    from pipelines.scene.file import read_scene as read_scene
    from survey.clouds.settings import CloudOptions as CloudOptions
    from survey.clouds.settings import MaskOptions as MaskOptions
    from survey.formats.options import ReadingOptions as ReadingOptions
    from survey.formats.reading import open_survey as open_survey
    from survey.registration.stones import survey_stones as survey_stones

_HOMES = {
    "Block": "mechanics.scene.scene",
    "CloudOptions": "survey.clouds.settings",
    "Fidelity": "mechanics.scene.scene",
    "MaskOptions": "survey.clouds.settings",
    "Material": "mechanics.stones.materials",
    "ReadingOptions": "survey.formats.options",
    "Result": "mechanics.results.result",
    "Scene": "mechanics.scene.scene",
    "Stage": "mechanics.scene.stages",
    "assemble": "pipelines.run.assemble",
    "assess": "pipelines.assess.assess",
    "find": "archmodel.query.api",
    "find_rows": "archmodel.query.api",
    "history": "archmodel.describe.history",
    "ingest": "pipelines.ingest.ingest",
    "load_path": "archmodel.relations.load_paths",
    "moma_solve": "pipelines.record.export.compas_solve",
    "open_database": "archmodel.database.session",
    "open_survey": "survey.formats.reading",
    "read_scene": "pipelines.scene.file",
    "record": "pipelines.record.record",
    "report_surveys": "pipelines.reports.survey.report",
    "run_scene": "pipelines.run.run",
    "simulate": "mechanics.simulate",
    "simulate_stages": "mechanics.simulate",
    "survey_stones": "survey.registration.stones",
    "trace": "archmodel.describe.trace",
}
__all__ = [*_HOMES, "MomaError", "__version__"]

__version__: str


def __getattr__(name: str) -> object:
    if name == "__version__":
        from importlib.metadata import version

        return version("moma-masonry")
    if name not in _HOMES:
        raise AttributeError(f"module 'moma' has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
