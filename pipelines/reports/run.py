"""report.html: one self-contained page that explains a run to readers who were not there."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from archmodel.quantities import Quantity, quantities_of
from archmodel.store.run_record import StoneResult
from archmodel.tables.structures import structure_kinds
from mechanics.arrays import Array
from mechanics.results.result import Result
from pipelines.draw.plots import history_svg
from pipelines.reports.html import (
    Table,
    in_words,
    input_rows,
    kilonewtons,
    kilopascals,
    megapascals,
    millimetres,
    percent,
    picture,
    ratio,
    scientific,
    table_of,
    write_page,
)
from pipelines.reports.page.model import Model
from pipelines.reports.peaks import peak_table
from survey.conventions import LARGEST, SAME

_OUTCOMES = {
    "equilibrium": "It stands as surveyed: every stone is at rest, in balance.",
    "settled": "It does not stand as surveyed: every stone came to rest, in balance, but not all in their places.",
    "moving": "It was still moving at the end of the simulated time: neither at rest nor collapsed.",
    "collapsed": "It falls: at least one stone moved too far to come back, and was still moving.",
    "undecided": "Nothing can be said: the steps that would decide were not solved, or self-stress holds what rests.",
    "interrupted": "It was interrupted before its time: what it would have come to is not known.",
}

_OPEN = ("moving", "undecided", "interrupted")

_GREY = "Grey stones are fixed or rigid, or their stress was not requested."
_CAPTIONS = {
    "von_mises.png": "Von Mises stress on the stones' surface, in MPa. The scale ends at the stress that 1 % "
    f"of the volume exceeds, rounded up. {_GREY}",
    "displacement.png": "Displacement of each point since the start; stones are drawn at their final position, "
    "without exaggeration. Fixed stones are grey.",
    "principal_tension.png": f"Largest principal stress, where it is tension. {_GREY}",
    "principal_compression.png": f"Smallest principal stress, where it is compression. {_GREY}",
    "utilisation.png": f"Stress over strength, the larger of tension and compression: at 1 a stone fails. {_GREY}",
    "error.png": "Estimated error of the stress of each stone (Zienkiewicz and Zhu): where it is large, the mesh is "
    f"too coarse for its stress. {_GREY}",
    "pressure.png": "Mean pressure of each compressed joint; the stones are transparent. The scale ends where joints "
    "that carry 1 % of the force exceed it, rounded up.",
    "resultants.png": "The resultant of each joint, drawn through the point where it meets the joint, its length in "
    "proportion. Blue: within the kern, so that a linear pressure acts everywhere. Red: outside, so that part of the "
    "joint is unloaded.",
}


_KERN = (
    "The resultant of a joint lies within its kern, up to 1 here, if a linear pressure compresses the whole "
    "joint; beyond, part of the joint is unloaded. Where it reaches the edge, at 1 in the next column, a hinge forms."
)
_CORNERS = (
    "The largest stress is that of a corner or an edge, and grows with every finer mesh; what 1 % of the volume "
    "exceeds does not."
)
_STRESS_ERROR = (
    "Estimated from the jumps of the stress between finite elements; a finer mesh makes it smaller."
)

_STAGES = (
    "Each stage began at rest where the one before had ended, with its forces. Displacements count from where stones "
    "were laid, all other numbers of this page are of the last stage. Beds are the mortar that makes up for movements "
    "before a stone was laid; negative: cut off it."
)

_WALL = {"along": "to the right along the wall", "outwards": "outwards", "up": "upwards"}
_SEEN = SAME  # over the width of a joint: a smaller movement is rounding


@dataclass(frozen=True)
class _Section:
    """Table under a heading; left out of the page where it has no rows."""

    title: str
    table: Table
    note: str = ""


def write_report(
    path: Path,
    result: Result,
    summary: Mapping[str, Any],
    stones: Sequence[StoneResult],
    warnings: Sequence[str],
    history: str | None = None,
    model: Model | None = None,
) -> None:
    """Write the page and embed the pictures of its folder.

    Parameters
    ----------
    path : report.html
    summary : as in summary.json
    stones : one per stone
    warnings : shown at the top
    history : the result's `history_svg`, where it has been drawn already
    model : content of the viewer; None: the page has none
    """
    pictures = [path.parent / name for name in _CAPTIONS]
    write_page(
        path,
        "run.html",
        model,
        name=result.scene.name,
        lead=_OUTCOMES[str(result.outcome)],
        decided=str(result.outcome) not in _OPEN,
        headline=_capital(summary["headline"]),
        cautions=summary["cautions"],
        warnings=warnings,
        pictures=[picture(one, _CAPTIONS[one.name]) for one in pictures if one.is_file()],
        summary=_summary_rows(summary, stones),
        notes=_notes(summary),
        peaks=peak_table(summary),
        inputs=input_rows(summary),
        errors=[
            (one.label, _error(one.name, result, summary), one.meaning)
            for one in quantities_of("run").values()
        ],
        profile=_profile(summary["profile"]),
        sections=[
            _stages(summary),
            _stressed(stones, summary["tolerance"]["length"]),
            _pulled(stones),
            _uncertain(stones),
            *_joints(result, summary),
            *_structures(summary),
        ],
        history=history_svg(result.history) if history is None else history,
        stages=[(stage, f"{seconds:.2f} s") for stage, seconds in summary["time"]["by_stage"].items()],
        version=summary["version"],
        versions=summary.get("versions"),
    )


def _summary_rows(summary: Mapping[str, Any], stones: Sequence[StoneResult]) -> list[tuple[str, str]]:
    bodies, stress, reaction = summary["bodies"], summary["von_mises"], summary["reaction"]
    labels = quantities_of("summary")
    rows = [
        ("Stones", ", ".join(f"{count} {name}" for name, count in bodies.items())),
        (labels["contacts"].label, str(summary["contacts"])),
        (labels["reaction.weight"].label, kilonewtons(reaction["weight"])),
        (labels["reaction.total_vertical"].label, kilonewtons(reaction["total_vertical"])),
        (labels["displacement.max"].label, _displacement(summary)),
        *_in_wall(summary),
    ]
    if stress is not None:
        rows += [
            (labels["von_mises.p99"].label, megapascals(stress["p99"])),
            (labels["von_mises.mean"].label, megapascals(stress["mean"])),
            (labels["von_mises.max"].label, f"{megapascals(stress['max'])}{_largest_error(stones)}"),
        ]
    if (static := summary["static"]) is not None and static["found"]:
        rows.append(
            (
                "Began in static equilibrium",
                f"found in {static['steps']} steps, balance {static['balance']:.1e}",
            )
        )
    time = summary["time"]
    simulated = f"{time['simulated']:.4g} s in {summary['steps']} steps, {time['wall']:.1f} s of work"
    rows.append((labels["time.simulated"].label, simulated))
    return rows


def _largest_error(stones: Sequence[StoneResult]) -> str:
    """Return the estimated error of the stress of the stone with the largest one."""
    worst = _worst(stones, lambda stone: stone.von_mises_max)[:1]
    known = [stone.values["stress_error"] for stone in worst if "stress_error" in stone.values]
    return "".join(f" in {worst[0].code}, error of its stress {percent(error)}" for error in known)


def _displacement(summary: Mapping[str, Any]) -> str:
    """Format the largest displacement of the run and, where another is left, that at its end."""
    found, least = summary["displacement"], summary["tolerance"]["length"]
    largest, end = (millimetres(found[key], least) for key in ("max", "end"))
    if found["time"] is None or largest == end:
        return largest
    return f"{largest} after {found['time']:.4g} s; {end} at the end"


def _in_wall(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the largest displacement at the end in the axes of the wall, and its place; nothing of a still one."""
    found, least = summary.get("wall"), summary["tolerance"]["length"]
    if found is None or summary["displacement"]["end"] < least:
        return []
    one = found["displacement"]
    parts = ", ".join(f"{millimetres(one[key], least)} {words}" for key, words in _WALL.items())
    place = f"{one['above_foot']:.2f} m above the foot, {one['from_left']:.2f} m from the left end"
    return [("In the axes of the wall, at the end", f"{parts} ({one['stone']}, {place})")]


def _notes(summary: Mapping[str, Any]) -> list[str]:
    """Return what must be known of the forces: slivers, and other states of force that are in balance too."""
    notes, slivers = [], summary["joints"]["slivers"]
    if slivers["count"]:
        notes.append(
            f"Slivers are joints whose area is not above {100 * slivers['limit']:g} % of the faces of their stones: "
            f"{slivers['count']} of {summary['joints']['count']}. They carry {kilonewtons(slivers['force'])} "
            f"({kilonewtons(slivers['largest_force'])} at most); their pressures, up to "
            f"{megapascals(slivers['largest_pressure'])}, say nothing of the masonry and are left out of the largest "
            "values, the tables and the scales of colours."
        )
    if (text := summary["admissible"]["text"]) is not None:
        notes.append(
            f"{_capital(text)}. What depends on them alone, a largest pressure above all, can be otherwise."
        )
    notes.append(
        f"Movements below {summary['tolerance']['length'] * 1e3:.1g} mm are within the tolerance of the solver."
    )
    return notes


def _error(key: str, result: Result, summary: Mapping[str, Any]) -> str:
    """Format an error measure; below the tolerance to which the run was solved, as such."""
    scene, value = result.scene, summary["errors"][key]
    tolerances = {"natural_map": scene.solver.tolerance, "balance": scene.time.balance_tolerance}
    if value is not None and key in tolerances and value <= tolerances[key]:
        return f"{scientific(value)}, below tolerance {tolerances[key]:g}"
    return scientific(value)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _profile(profile: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """Format the settings that a profile gave the run and the errors to expect of it."""
    if profile is None:
        return None
    return {
        "name": profile["name"],
        "about": profile["about"],
        "settings": ", ".join(f"{name} {value}" for name, value in profile["settings"].items()),
        "expected": table_of(
            "expected error",
            list(profile["expected"].values()),
            lambda error: {
                "quantity": error["of"].capitalize(),
                "value": f"{'up to ' if error['bound'] else ''}{percent(error['value'])}",
            },
        ),
    }


def _stages(summary: Mapping[str, Any]) -> _Section:
    """List the stages of building."""
    return _Section("Stages of building", table_of("stage", summary["stages"], _stage), _STAGES)


def _stage(stage: Mapping[str, Any]) -> dict[str, str]:
    return {
        "stage": stage["name"],
        "outcome": stage["outcome"],
        "stones": str(stage["stones"]),
        "laid": ", ".join(f"{stage[name]} {name}" for name in ("laid", "removed", "held") if stage[name]),
        "weight": kilonewtons(stage["weight"]),
        "reaction": kilonewtons(stage["reaction"]),
        "displacement": f"{millimetres(stage['displacement']['max'])} "
        f"({stage['displacement']['stone'] or 'none moves'})",
        "bed": f"{1e3 * stage['bed']:+.1f} mm" if stage["bed"] else "",
        "balance": scientific(stage["errors"]["balance"]),
    }


def _stressed(stones: Sequence[StoneResult], least: float) -> _Section:
    """List the stones with the largest stress that 1 % of their volume exceeds."""

    def cells(stone: StoneResult) -> dict[str, str]:
        """Return the texts of a stone."""
        error = stone.values.get("stress_error")
        return {
            "stone": stone.code,
            "von_mises_p99": megapascals(stone.von_mises_p99),
            "von_mises_mean": megapascals(stone.von_mises_mean),
            "von_mises_max": megapascals(stone.von_mises_max),
            "stress_error": "–" if error is None else percent(error),
            "displacement_max": millimetres(stone.displacement_max, least),
        }

    worst = _worst(stones, lambda stone: stone.von_mises_p99)
    return _Section("Most stressed stones", table_of("stone", worst, cells), _CORNERS)


def _pulled(stones: Sequence[StoneResult]) -> _Section:
    """List the stones nearest to their strength or, where no strength is known, with the largest tension."""

    def cells(stone: StoneResult) -> dict[str, str]:
        """Return the texts of a stone."""
        return {
            "stone": stone.code,
            "utilisation": ratio(stone.values.get("utilisation")),
            "principal_tension": megapascals(stone.values["principal_tension"]),
            "tension_zone": percent(stone.values["tension_zone"]),
            "principal_compression": megapascals(stone.values["principal_compression"]),
            "mean_pressure": megapascals(stone.values["mean_pressure"]),
        }

    used = _worst(stones, lambda stone: stone.values.get("utilisation"))
    worst = used or _worst(stones, lambda stone: stone.values.get("principal_tension"))
    title = "Stones nearest to their strength" if used else "Stones with the largest tension"
    return _Section(title, table_of("stone", worst, cells))


def _uncertain(stones: Sequence[StoneResult]) -> _Section:
    """List the stones whose stress is least certain."""

    def cells(stone: StoneResult) -> dict[str, str]:
        """Return the texts of a stone."""
        return {
            "stone": stone.code,
            "stress_error": percent(stone.values["stress_error"]),
            "von_mises_p99": megapascals(stone.von_mises_p99),
        }

    worst = _worst(stones, lambda stone: stone.values.get("stress_error"))
    return _Section("Stones with the least certain stress", table_of("stone", worst, cells), _STRESS_ERROR)


def _worst(stones: Sequence[StoneResult], value: Callable[[StoneResult], float | None]) -> list[StoneResult]:
    """Return the stones with the largest values, of those that have one."""
    known = [(found, stone) for stone in stones if (found := value(stone)) is not None]
    known.sort(key=lambda pair: pair[0], reverse=True)
    return [stone for _, stone in known[:LARGEST]]


def _joints(result: Result, summary: Mapping[str, Any]) -> list[_Section]:
    """List the joints with the most eccentric resultants, and those that slid or opened most."""
    joints = result.joints
    least = float(summary["tolerance"]["length"])
    seen = np.maximum(_SEEN * np.sqrt(joints.area), least)
    eccentric = np.where(joints.bearing, joints.kern, -np.inf)
    slid = np.where(joints.sliding > seen, joints.sliding, -np.inf)
    opened = np.where(joints.opening > seen, joints.opening, -np.inf)
    return [
        _Section("Joints with the most eccentric resultants", _joint_table(result, eccentric, least), _KERN),
        _Section("Joints that slid most", _joint_table(result, slid, least)),
        _Section("Joints that opened most", _joint_table(result, opened, least)),
    ]


def _structures(summary: Mapping[str, Any]) -> list[_Section]:
    """List the results of structures, those with the largest values by the first of them, in a table for each kind."""
    sections = []
    for kind in dict.fromkeys(structure["kind"] for structure in summary["structures"]):
        quantities = quantities_of(*structure_kinds(), kind)
        of_kind = [structure for structure in summary["structures"] if structure["kind"] == kind]
        shown = [name for name in quantities if any(name in structure for structure in of_kind)]
        of_kind.sort(key=lambda structure: -structure.get(shown[0], -np.inf))
        rows = [
            (structure["code"], *(_value(structure.get(name), quantities[name], summary) for name in shown))
            for structure in of_kind[:LARGEST]
        ]
        words = kind.replace("_", " ")
        head = (_capital(words), *(quantities[name].heading for name in shown))
        sections.append(_Section(f"Results by {words}", Table(head, rows, len(rows))))
    return sections


def _value(value: float | None, quantity: Quantity, summary: Mapping[str, Any]) -> str:
    return "–" if value is None else in_words(value, quantity.unit, summary["tolerance"]["length"])


def _joint_table(result: Result, order: Array, least: float) -> Table:
    """Describe the joints with the largest finite values of `order`; movements below `least` [m] as such."""
    joints, codes = result.joints, [body.code for body in result.bodies]
    largest = [k for k in np.argsort(-order, kind="stable")[:LARGEST].tolist() if np.isfinite(order[k])]
    return table_of(
        "joint",
        largest,
        lambda k: {
            "joint": " – ".join(codes[body] for body in joints.bodies[k]),
            "kern": ratio(float(joints.kern[k])),
            "edge": ratio(float(joints.edge[k])),
            "pressure_mean": "sliver" if joints.sliver[k] else kilopascals(float(joints.pressure_mean[k])),
            "opening": millimetres(float(joints.opening[k]), least),
            "sliding": millimetres(float(joints.sliding[k]), least),
            "friction_use": ratio(float(joints.friction_use[k])),
        },
    )
