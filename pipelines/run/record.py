"""Database record of a run, in the frame of the site, from the result of its simulation."""

import math
import platform
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields, is_dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from archmodel.database.session import Database
from archmodel.store.run_record import (
    Columns,
    ErrorMeasures,
    RunRecord,
    SimplificationRecord,
    StoneResult,
)
from archmodel.store.runs import store_run
from archmodel.store.stone_rows import solid_volume
from archmodel.tables.runs import ContactPoint
from archmodel.tables.runs import JointResult as JointRow
from ground.errors import DatabaseError
from mechanics.arrays import Array
from mechanics.results.contact_result import ContactResult, JointResult
from mechanics.results.result import Errors, Result
from mechanics.scene.scene import Scene
from pipelines.results.stone_values import joint_values
from pipelines.results.structure_values import structure_results
from pipelines.run.assemble import Assembly
from pipelines.scene.file import SceneFile
from survey.joints.report import ClosingReport, StoneJoint

_LIBRARIES = ("numpy", "scipy", "numba", "llvmlite", "scikit-fem", "gmsh", "sqlalchemy")


def run_record(
    result: Result,
    stones: tuple[StoneResult, ...],
    scene: SceneFile,
    assembly: Assembly,
    summary: Mapping[str, Any],
    as_of: int | None,
) -> RunRecord:
    """Return the record of a run.

    Parameters
    ----------
    result : of the simulation
    stones : its results by stone
    scene, assembly : the scene as its author wrote it and as it was built
    summary : the contents of summary.json
    as_of : the last entry in the database when the stones were read
    """
    # of a building in stages, those of the last
    standing = {block.code for block in result.scene.blocks}
    return RunRecord(
        scene=scene.name,
        scene_text=scene.text,
        outcome=str(result.outcome),
        summary=summary,
        versions=versions(),
        results=stones,
        structures=structure_results(result, assembly.structures),
        settings=settings_of(scene, assembly.scene),
        as_of=as_of,
        steps=result.steps,
        simulated=result.time,
        wall=summary["time"]["wall"],
        errors=error_measures(result.errors),
        joints=joint_columns(
            result.joints,
            assembly.origin,
            surveyed_widths(result.joints, [block.code for block in result.scene.blocks], assembly.closing),
        ),
        contacts=contact_columns(result.contacts, assembly.origin),
        simplifications=tuple(
            simplification for simplification in simplifications(assembly) if simplification.code in standing
        ),
    )


def joint_columns(joints: JointResult, origin: Array, widths: Array) -> Columns:
    """Return the joints in the frame of the site, given the scene's `origin` (3,) and surveyed `widths` (nj,) [m]."""
    values = joint_values(joints, origin, slivers=False) | _components("n", joints.frame[:, 0])
    values |= {"first": joints.bodies[:, 0], "second": joints.bodies[:, 1], "width": widths}
    return {name: values[name] for name in _named_columns(JointRow)}


def contact_columns(contacts: ContactResult, origin: Array) -> Columns:
    """Return the contact points in the frame of the site, given the scene's `origin` (3,) [m]."""
    values = {
        "candidate": contacts.bodies[:, 0],
        "antagonist": contacts.bodies[:, 1],
        **_components("", contacts.point + origin),
        **_components("n", contacts.normal),
        **_components("f", contacts.force),
    }
    return {
        name: values[name] if name in values else getattr(contacts, name)
        for name in _named_columns(ContactPoint)
    }


def _components(prefix: str, vectors: Array) -> dict[str, NDArray[np.generic]]:
    """Return the components of vectors (n, 3) by the names of their columns."""
    return {f"{prefix}{axis}": column for axis, column in zip("xyz", vectors.T, strict=True)}


def _named_columns(table: type[JointRow] | type[ContactPoint]) -> list[str]:
    """Return the columns of a table that a record gives, stones without the ending of their keys."""
    names = (column.name.removesuffix("_id") for column in table.__table__.columns)
    return [name for name in names if name not in ("run", "number")]


def surveyed_widths(joints: JointResult, codes: Sequence[str], closing: ClosingReport) -> Array:
    """Return the surveyed width of each joint of a run (nj,) [m]; NaN where the stones were not found to face.

    Parameters
    ----------
    joints : of the run
    codes : of its stones, in the order of their numbers
    closing : joints before the run. Of several joints of two stones, the one of most similar orientation counts
    """
    by_stones: dict[frozenset[str], list[StoneJoint]] = defaultdict(list)
    for joint in closing.joints:
        by_stones[frozenset(joint.stones)].append(joint)
    widths = np.full(len(joints.area), np.nan)
    for number, (stones, frame) in enumerate(zip(joints.bodies.tolist(), joints.frame, strict=True)):
        between = by_stones.get(frozenset(codes[stone] for stone in stones))
        if between:
            alike = max(between, key=lambda candidate: abs(float(candidate.normal @ frame[0])))
            # overlapping measurements give no thickness of mortar
            widths[number] = alike.width if alike.width >= 0.0 else np.nan
    return widths


def simplifications(assembly: Assembly) -> tuple[SimplificationRecord, ...]:
    """Return the solids that represented the stones, compared with those of the survey."""
    mode, records = str(assembly.closing.mode), []
    for model, simple, block in zip(assembly.models, assembly.simplified, assembly.scene.blocks, strict=True):
        surveyed, vertices = model.record.solid_vertices - assembly.origin, block.vertices
        measured, _ = solid_volume(surveyed, model.record.solid_faces)
        volume, _ = solid_volume(vertices, block.faces)
        apart = np.linalg.norm(vertices[:, None] - surveyed[None], axis=2)
        records.append(
            SimplificationRecord(
                code=block.code,
                mode=mode,
                displacement_max=float(apart.min(axis=1).max()),
                volume_change=volume / measured - 1.0,
                vertices=vertices + assembly.origin,
                faces=block.faces,
                shape=str(simple.shape),
                blockiness=float(simple.report.blockiness),
                worst_angle=math.radians(simple.report.worst_angle),
                within_tolerance=bool(simple.report.within),
            )
        )
    return tuple(records)


def settings_of(scene: SceneFile, built: Scene) -> dict[str, Any]:
    """Return time, solver, contact and joints as used, with defaults; laws of single joints are in the text."""
    contact = built.contact
    return {
        "gravity": list(built.gravity),
        "joints": _values(scene.joints),
        "contact": {
            "law": {"type": type(contact.law).__name__, **_values(contact.law)},
            **{
                name: value
                for name, value in _values(contact).items()
                if name not in ("law", "rules", "thickness")
            },
        },
        "time": _values(built.time),
        "solver": _values(built.solver),
    }


@cache
def versions() -> Mapping[str, str]:
    """Return the versions of MOMA, of Python and of the numerical libraries."""
    libraries = {name: _version(name) for name in _LIBRARIES}
    return {"moma": version("moma-masonry"), "python": platform.python_version(), **libraries}


def _version(package: str) -> str:
    """Return the version of a package; some may be absent."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def error_measures(errors: Errors) -> ErrorMeasures:
    """Return the error measures; None where one could not be computed."""
    measured = _shared(ErrorMeasures, errors)
    return ErrorMeasures(
        **{name: value if math.isfinite(value) else None for name, value in measured.items()}
    )


def _shared(record: type[Any], source: object) -> dict[str, Any]:
    """Return the fields of a record that the source has under the same name."""
    return {
        field.name: getattr(source, field.name) for field in fields(record) if hasattr(source, field.name)
    }


def _values(settings: object) -> dict[str, Any]:
    """Return the fields of a settings value, enumerations as texts."""
    if not is_dataclass(settings) or isinstance(settings, type):
        return {}
    return {
        name: value if isinstance(value, bool | int | float | None) else str(value)
        for name, value in asdict(settings).items()
    }


def store_record(database: Database, folder: Path, record: RunRecord) -> int:
    """Store a run whose results are in a folder; return its number.

    Raises
    ------
    DatabaseError : it could not be stored; names the folder, which is complete
    """
    try:
        with database.session() as session:
            return store_run(session, record)
    except DatabaseError as error:
        what = f"the results are in {folder}, but could not be stored: {error.what}"
        raise DatabaseError(what, where=error.where, remedy=error.remedy) from error
