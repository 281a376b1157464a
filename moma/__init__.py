"""MOMA: from a stone-by-stone survey of a historic building to a mechanical simulation of it.

What scripts need, each loaded when it is first used::

    import moma

    moma.ingest(["window.moma"], "sqlite:///moma.db")
    with moma.open_database("sqlite:///moma.db") as database, database.session(read_only=True) as session:
        deep = moma.find(session, "header", ["depth > 0.4"])
    done = moma.run_scene("window.toml", "sqlite:///moma.db", "out/window")
    print(done.summary["outcome"])
"""

from importlib import import_module
from typing import TYPE_CHECKING

from moma.errors import MomaError

if TYPE_CHECKING:
    from archmodel.database import open_database
    from archmodel.query import find
    from mechanics.result import Result
    from mechanics.scene import Block, Scene
    from mechanics.simulate import simulate
    from pipelines.assemble import assemble
    from pipelines.ingest import ingest
    from pipelines.run import run_scene
    from pipelines.scenefile import read_scene

__all__ = [
    "Block",
    "MomaError",
    "Result",
    "Scene",
    "__version__",
    "assemble",
    "find",
    "ingest",
    "open_database",
    "read_scene",
    "run_scene",
    "simulate",
]

_HOMES = {
    "Block": "mechanics.scene",
    "Result": "mechanics.result",
    "Scene": "mechanics.scene",
    "assemble": "pipelines.assemble",
    "find": "archmodel.query",
    "ingest": "pipelines.ingest",
    "open_database": "archmodel.database",
    "read_scene": "pipelines.scenefile",
    "run_scene": "pipelines.run",
    "simulate": "mechanics.simulate",
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
