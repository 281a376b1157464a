"""A scene from file to limit loads: its stones, bound, candidate and mechanism of each load, files."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from archmodel.database.session import open_database
from mechanics.dynamics.progress import Listener, Progress, silent
from mechanics.limit.assembly import Assembly, assembly
from mechanics.limit.limit_load import Flow, LimitLoad, limit_load
from mechanics.limit.live_loads import Acceleration, LiveLoad
from mechanics.results.forecast.plan import loose_blocks
from mechanics.scene.scene import Fidelity
from moma.errors import MissingLibraryError, SolverError
from pipelines.assess.loads import parse_load, scene_loads
from pipelines.draw.mechanism import draw_mechanism
from pipelines.results.folder import check_replaceable, replacing
from pipelines.results.summary import as_json
from pipelines.run.assemble import Assembly as Assembled
from pipelines.run.assemble import assemble_stones
from pipelines.run.record import versions
from pipelines.run.soundness import problems_of, refuse_unsound
from pipelines.scene.file import read_scene
from pipelines.scene.selection import select_groups, select_stones

__all__ = ["INDEX", "Assessment", "assess_scene"]

INDEX = "assessment.json"
"""Index of the results of an assessment."""

_MOVES = 0.01  # speed over that of the fastest stone from which a stone belongs to a mechanism [-]


@dataclass(frozen=True)
class Assessment:
    """Limit loads of a scene.

    Attributes
    ----------
    folder : of the files
    summary : contents of assessment.json
    warnings : requests that were not met
    """

    folder: Path
    summary: dict[str, Any]
    warnings: tuple[str, ...]


def assess_scene(
    path: str | Path,
    url: str,
    folder: str | Path,
    loads: Sequence[str] = (),
    progress: Listener = silent,
) -> Assessment:
    """Return limit loads and mechanisms of a scene file on the stones of a database, and write them into a folder.

    Parameters
    ----------
    path : scene file
    url : of the database
    folder : of the results; earlier ones there are replaced
    loads : in words (`parse_load`); none: those of the scene's [[assess]], or horizontal along x, -x, y, -y
    progress : called at every stage

    Raises
    ------
    UsageError : the folder holds other files, or a load cannot be read
    UnsoundSceneError : the scene has problems that `check_scene` reports
    SceneError, GeometryError, SolverError : see `assemble` and `mechanics.limit`
    DatabaseError : the database cannot be read
    """
    folder, scene, asked = Path(folder), read_scene(path), tuple(map(parse_load, loads))
    check_replaceable(folder, INDEX)
    progress(Progress("blocks", 0, None, "reading the stones"))
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        models = select_stones(scene, session)
        progress(Progress("blocks", 0, None, f"closing the joints of {len(models)} stones"))
        assembled = assemble_stones(scene, models, select_groups(scene, session, models))
    named = asked or scene_loads(scene, assembled.origin)
    on = assembly(assembled.scene)
    refuse_unsound(problems_of(scene, assembled, loose_blocks(on.model, on.state)), str(path))
    summary: dict[str, Any] = _summary(assembled, on) | {"loads": []}
    found: list[LimitLoad] = []
    for number, (name, live) in enumerate(named):
        progress(Progress("assess", number, len(named), name))
        bound = limit_load(on, live)
        candidate = _candidate(on, live, bound)
        found.append(bound if candidate is None else candidate)
        summary["loads"].append(_described(on, name, live, bound, candidate))
    summary["headline"] = _headline(summary["loads"])
    summary["versions"] = dict(versions())
    progress(Progress("write", 0, 1, "pictures"))
    warnings: list[str] = []
    with replacing(folder, INDEX) as fresh:
        summary["files"] = [INDEX, "scene.toml"]
        try:
            summary["files"] += draw_mechanism(
                fresh,
                assembled.scene.blocks,
                on,
                found,
                [
                    f"{scene.name}\n{one['headline'].replace('λ ≤', 'multiplier at most')}"
                    for one in summary["loads"]
                ],
                assembled.towards,
            )
        except MissingLibraryError as error:
            warnings.append(f"no pictures: {error}")
        (fresh / "scene.toml").write_text(scene.text, encoding="utf-8")
        (fresh / INDEX).write_text(as_json(summary), encoding="utf-8")
    progress(Progress("write", 1, 1))
    return Assessment(folder, summary, tuple(warnings))


def _candidate(on: Assembly, live: LiveLoad, bound: LimitLoad) -> LimitLoad | None:
    """Return the candidate of Coulomb's friction; None where there is none to be found."""
    if not np.isfinite(bound.multiplier):
        return None
    try:
        candidate = limit_load(on, live, Flow.COULOMB, bound)
    except SolverError:
        return None
    return candidate if np.isfinite(candidate.multiplier) else None


def _summary(assembled: Assembled, on: Assembly) -> dict[str, Any]:
    soft = sum(block.fidelity is Fidelity.DEFORMABLE for block in assembled.scene.blocks)
    cautions = [
        "stones are rigid and do not crush; joints keep their geometry until the mechanism moves",
        *([f"{soft} deformable stones count as rigid"] if soft else []),
        *([f"gaps of up to {1e3 * on.widest:.2g} mm count as closed"] if on.widest > 1e-6 else []),
    ]
    return {
        "scene": assembled.scene.name,
        "stones": len(on.model.mass),
        "free": len(on.free),
        "weight": on.weight,
        "contacts": len(on.contacts),
        "cautions": [*cautions, *assembled.remarks],
    }


def _described(
    on: Assembly, name: str, live: LiveLoad, bound: LimitLoad, candidate: LimitLoad | None
) -> dict[str, Any]:
    """Return what assessment.json says of a load."""
    lowest = bound if candidate is None else candidate
    described: dict[str, Any] = {
        "name": name,
        "meaning": str(live),
        "bound": _number(bound.multiplier),
        "bound_kind": "associative friction, rigorous upper bound",
        "candidate": None if candidate is None else _number(candidate.multiplier),
        "candidate_kind": "Coulomb's friction without dilatancy, candidate: the stones may fall at less",
        "candidate_converged": None if candidate is None else candidate.converged,
        "outcome": _outcome(bound.multiplier),
    }
    if isinstance(live, Acceleration) and np.isfinite(lowest.multiplier):
        described["tilt"] = float(np.degrees(np.arctan(lowest.multiplier)))
    described["headline"] = _sentence(described)
    speed = np.linalg.norm(lowest.velocity[:, :3], axis=1)
    turning = 0.5 * on.model.surfaces.size[on.free] * np.linalg.norm(lowest.velocity[:, 3:], axis=1)
    moves = np.flatnonzero(speed + turning > _MOVES)
    codes = [block.code for block in on.model.scene.blocks]
    described["mechanism"] = {
        "stones": [
            {
                "code": codes[on.free[row]],
                "velocity": lowest.velocity[row, :3].tolist(),
                "spin": lowest.velocity[row, 3:].tolist(),
            }
            for row in moves[np.argsort(-(speed + turning)[moves], kind="stable")]
        ],
        "opening_joints": _joints(on, lowest.opening),
        "sliding_joints": _joints(on, lowest.sliding & ~lowest.opening),
    }
    return described


def _joints(on: Assembly, chosen: Any) -> int:
    return len(np.unique(np.sort(on.contacts.bodies[chosen], axis=1), axis=0))


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _outcome(bound: float) -> str:
    if np.isnan(bound):
        return "falls under its own weight"
    return "nothing limits it" if np.isinf(bound) else "limited"


def _sentence(one: dict[str, Any]) -> str:
    if one["bound"] is None:
        return f"{one['name']}: {one['outcome']}"
    text = f"{one['name']}: λ ≤ {one['bound']:.4g} (bound)"
    if one["candidate"] is None:
        return f"{text}, NO CANDIDATE found"
    stood = "" if one["candidate_converged"] else ", NOT CONVERGED"
    angle = f", a tilt of {one['tilt']:.3g}°" if "tilt" in one else ""
    return f"{text}, {one['candidate']:.4g} (candidate{stood}){angle}"


def _headline(loads: Sequence[dict[str, Any]]) -> str:
    """Return the decisive load in a sentence: the least candidate, or what cannot stand at all."""
    falls = [one for one in loads if one["outcome"] == _outcome(float("nan"))]
    if falls:
        return "it falls under its own weight"
    limited = [one for one in loads if one["bound"] is not None]
    if not limited:
        return "nothing limits its loads"
    return str(
        min(limited, key=lambda one: one["bound"] if one["candidate"] is None else one["candidate"])[
            "headline"
        ]
    )
