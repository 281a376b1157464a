"""MOMA: from a stone-by-stone survey of a historic building to a mechanical simulation of it.

What scripts need, each loaded when it is first used::

    import moma

    moma.report_surveys(["window.moma"], "out/survey-window")
    moma.ingest(["window.moma"], "sqlite:///moma.db")
    moma.record(["knowledge.toml"], "sqlite:///moma.db")
    with moma.open_database("sqlite:///moma.db") as database, database.session(read_only=True) as session:
        deep = moma.find(session, "header", ["depth > 0.4"])
    done = moma.run_scene("window.toml", "sqlite:///moma.db", "out/window")
    print(done.summary["outcome"])
"""

from importlib import import_module
from typing import TYPE_CHECKING

from moma.errors import MomaError

if TYPE_CHECKING:
    from archmodel.database.session import open_database
    from archmodel.describe.history import history
    from archmodel.describe.trace import trace
    from archmodel.query.api import find, find_rows
    from archmodel.relations.graph import load_path
    from mechanics.results.result import Result
    from mechanics.scene.scene import Block, Scene
    from mechanics.simulate import simulate
    from pipelines.ingest.ingest import ingest
    from pipelines.record.record import record
    from pipelines.reports.survey.report import report_surveys
    from pipelines.run.assemble import assemble
    from pipelines.run.run import run_scene
    from pipelines.scene.file import read_scene
    from survey.formats.reading import ReadingOptions, open_survey
    from survey.stones import survey_stones

__all__ = [
    "Block",
    "MomaError",
    "ReadingOptions",
    "Result",
    "Scene",
    "__version__",
    "assemble",
    "find",
    "find_rows",
    "history",
    "ingest",
    "load_path",
    "open_database",
    "open_survey",
    "read_scene",
    "record",
    "report_surveys",
    "run_scene",
    "simulate",
    "survey_stones",
    "trace",
]

_HOMES = {
    "Block": "mechanics.scene.scene",
    "ReadingOptions": "survey.formats.reading",
    "Result": "mechanics.results.result",
    "Scene": "mechanics.scene.scene",
    "assemble": "pipelines.run.assemble",
    "find": "archmodel.query.api",
    "find_rows": "archmodel.query.api",
    "history": "archmodel.describe.history",
    "ingest": "pipelines.ingest.ingest",
    "load_path": "archmodel.relations.graph",
    "open_database": "archmodel.database.session",
    "open_survey": "survey.formats.reading",
    "read_scene": "pipelines.scene.file",
    "record": "pipelines.record.record",
    "report_surveys": "pipelines.reports.survey.report",
    "run_scene": "pipelines.run.run",
    "simulate": "mechanics.simulate",
    "survey_stones": "survey.stones",
    "trace": "archmodel.describe.trace",
}

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
