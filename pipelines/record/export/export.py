"""`moma export` into files of other programs, by ending."""

import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy.orm import Session

from archmodel.database.session import open_database
from archmodel.skos.writer import write_turtle
from ground.errors import ExchangeError, UsageError
from pipelines.draw.stratigraphy.matrix import draw, study
from pipelines.record.export.building import Building, read_building
from pipelines.record.export.compas import model_content, results_content
from pipelines.record.export.dxf import dxf_content
from pipelines.record.export.glb import glb_content
from pipelines.record.export.gpkg import write_gpkg
from pipelines.record.export.ifc import ifc_content


@dataclass(frozen=True)
class Exported:
    """A file for another program: its path, the database, its size in bytes; stones, groups and run that are in it."""

    path: str
    database: str
    bytes: int
    stones: int
    groups: int
    run: int | None


@dataclass(frozen=True)
class _Order:
    """Building to be written, and the session that it came from."""

    building: Building
    session: Session
    crs: str | None


def _results(order: _Order) -> bytes:
    if order.building.run is None:
        raise UsageError("results of no run", where="export", remedy="name the run with --run")
    return results_content(order.building, order.session)


def _matrix(session: Session) -> str:
    """Return the stratigraphic matrix for yEd."""
    return draw(study(session), Path("matrix.graphml"))


def _script_of_lmgc90(order: _Order) -> bytes:
    # what assembles scenes takes a second and 110 MB, which other formats do not need
    from pipelines.record.export.lmgc90 import lmgc90_content
    from pipelines.record.export.same_scene import same_scene

    return lmgc90_content(order.building, same_scene(order.session, order.building.run, "LMGC90"))


def _script_of_3dec(order: _Order) -> bytes:
    from pipelines.record.export.same_scene import same_scene
    from pipelines.record.export.threedec import threedec_content

    return threedec_content(order.building, same_scene(order.session, order.building.run, "3DEC"))


_CONTENTS: Mapping[str, Callable[[_Order], bytes]] = {
    ".ifc": lambda order: ifc_content(order.building, order.crs),
    ".dxf": lambda order: dxf_content(order.building),
    ".glb": lambda order: glb_content(order.building),
    ".compas.json": lambda order: model_content(order.building, order.session),
    ".results.json": _results,
    ".lmgc90.py": _script_of_lmgc90,
    ".3ddat": _script_of_3dec,
}

_KNOWLEDGE: Mapping[str, Callable[[Session], str]] = {".graphml": _matrix, ".ttl": write_turtle}
"""Files without stones: the stratigraphic matrix for yEd, vocabularies as SKOS."""

ENDINGS = (*_CONTENTS, *_KNOWLEDGE, ".gpkg")
"""Endings of the files that are written for other programs."""

_OF_CRS = (".ifc", ".gpkg")


def export_file(url: str, path: Path, run: int | None = None, crs: str | None = None) -> Exported:
    """Write the stones of a database into a file for another program.

    The file replaces an older one only when it is complete.

    Parameters
    ----------
    url : of the database
    path : of the file; its ending, one of `ENDINGS`, names the format
    run : whose results come along; None: none
    crs : coordinate reference system of the site, as AUTHORITY:NUMBER; None: not known

    Raises
    ------
    UsageError : the ending, the run or the system is wrong, or a package is missing
    ExchangeError : the file cannot be written
    """
    ending = next(ending for ending in ENDINGS if path.name.lower().endswith(ending))
    if crs is not None:
        _check_crs(crs, ending)
    if run is not None and ending in _KNOWLEDGE:
        raise UsageError(f"a file {ending} has no results", where="--run", remedy="leave it out")
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with open_database(url, create=False) as database, database.session(read_only=True) as session:
            building = None if ending in _KNOWLEDGE else read_building(session, run)
            shown = database.url
            if building is None:
                part.write_text(_KNOWLEDGE[ending](session), encoding="utf-8", newline="\n")
            elif ending == ".gpkg":
                write_gpkg(building, part, crs)
            else:
                part.write_bytes(_CONTENTS[ending](_Order(building, session, crs)))
        part.replace(path)
    except OSError as error:
        what = f"it cannot be written: {error.strerror}"
        raise ExchangeError(what, where=str(path), remedy="name a file in another folder") from error
    finally:
        with suppress(OSError):  # a folder that is read-only refuses this too
            part.unlink(missing_ok=True)
    stones, groups = (0, 0) if building is None else (len(building.codes), len(building.groups))
    return Exported(str(path), shown, path.stat().st_size, stones, groups, run)


def _check_crs(crs: str, ending: str) -> None:
    if ending not in _OF_CRS:
        remedy = f"leave it out; {' and '.join(_OF_CRS)} have one"
        raise UsageError(f"a file {ending} has no coordinate reference system", where="--crs", remedy=remedy)
    authority, _, number = crs.partition(":")
    if not authority or not number.isascii() or not number.isdigit():
        raise UsageError(f"{crs!r} is no reference system", where="--crs", remedy="write e.g. EPSG:25832")
