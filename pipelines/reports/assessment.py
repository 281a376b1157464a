"""report.html of an assessment: what decides, what each number is, checks by a code, mechanisms."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pipelines.reports.html import (
    direction_text,
    input_rows,
    kilonewtons,
    percent,
    picture,
    table_of,
    write_page,
)
from pipelines.reports.page.model import Model
from pipelines.results.wall_axes import WallAxes, axes_of
from survey.conventions import LISTED, TENTH

_CAPTIONS = {
    "mechanism": "As the stones begin to move, exaggerated.",
    "pushover": "What the stones bear as one of them is led to collapse.",
    "forces": "Resultants of the joints at the limit: blue within the kern, red outside.",
}
_SHARE = TENTH  # change of friction and depth by which the sensitivity of a limit is told [-]


def write_assessment(path: Path, summary: Mapping[str, Any], model: Model | None = None) -> None:
    """Write the page and embed the pictures of its folder.

    Parameters
    ----------
    path : report.html
    summary : as in assessment.json
    model : content of the viewer; None: the page has none
    """
    loads = summary["loads"]
    write_page(
        path,
        "assessment.html",
        model,
        name=summary["scene"],
        lead=f"{_lead(summary)}{summary['headline']}. {summary['free']} stones that may move, "
        f"{summary['contacts']} contact points, weight {1e-3 * summary['weight']:.2f} kN.",
        cautions=summary["cautions"],
        inputs=input_rows(summary),
        governs=_governs(summary),
        warnings=(),
        version=summary["versions"]["moma"],
        versions=summary["versions"],
        loads=table_of("load in assessment.json", loads, _load),
        parts=[_part(path.parent, number, load) for number, load in enumerate(loads, start=1)],
    )


def _lead(summary: Mapping[str, Any]) -> str:
    """Return the push that governs in a sentence: its direction, capacity and demand; nothing of other questions."""
    load, axes = summary["loads"][summary["governs"]], axes_of(summary["wall"])
    if "direction" not in load or "tilt" not in load or not load.get("limit"):
        return ""
    text = f"Pushed {direction_text(axes, load['direction'])}, the stones hold {100 * load['limit']:.4g} % of their "
    text += f"weight, {kilonewtons(load['limit'] * summary['weight'])}"
    if load["limit_lost"] is not None:
        text += f", and fall at {100 * load['limit_lost']:.4g} %"
    if load["limit_sure"] < load["limit"]:
        text += f", in a step that is not solved: they may fall from {100 * load['limit_sure']:.4g} % on"
    return f"{text}. Capacity against demand: {_demand(load)}. "


def _governs(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return what governs in words: direction, capacity against demand, mechanism, and how sure it is."""
    load, axes = summary["loads"][summary["governs"]], axes_of(summary["wall"])
    rows = [("Load", load["name"])]
    if "direction" in load:
        rows.append(("Direction", direction_text(axes, load["direction"])))
    if load["kind"] == "load" and (limit := load.get("limit")):
        push = "direction" in load and "tilt" in load
        force = f": {kilonewtons(limit * summary['weight'])} on all stones that may move" if push else ""
        rows += [("Capacity", f"λ = {_number(limit)}{force}"), ("Capacity against demand", _demand(load))]
    if stones := load["mechanism"]["stones"]:
        rows.append(("How it falls", _place(axes, stones)))
    rows.append(("How sure it is", _sure(load.get("sensitivity"))))
    return rows


def _demand(load: Mapping[str, Any]) -> str:
    """Return the comparisons of a code in words."""
    if "code" not in load:
        return "no demand was stated: --code with a table [site] compares this load with that of a code"
    return "; ".join(
        f"{check['name']}: {check['capacity']:.4g} against {check['demand']:.4g} {check['unit']}, ratio "
        f"{check['ratio']:.2f}, {'passed' if check['passed'] else 'NOT PASSED'}"
        for check in load["code"]["checks"]
    )


def _place(axes: WallAxes | None, stones: Sequence[Mapping[str, Any]]) -> str:
    """Return how many stones move, where they are in the wall, and which way the fastest goes."""
    first = stones[0]
    text = (
        f"{len(stones)} stones move, the fastest, {first['code']}, {direction_text(axes, first['velocity'])}"
    )
    if axes is None or any("centre" not in stone for stone in stones):
        return text
    places = [axes.place(np.array(stone["centre"])) for stone in stones]
    (left, right), (low, high) = ((min(values), max(values)) for values in zip(*places, strict=True))
    return (
        f"{text}; their centres are {low:.2f} to {high:.2f} m above the foot and {left:.2f} to {right:.2f} m from the "
        "left end"
    )


def _sure(limit: Mapping[str, Any] | None) -> str:
    """Return by how much the bound changes with friction and depth, to first order."""
    if limit is None:
        return "friction, depths and densities are taken as certain"
    changes = [
        ("less friction in all joints", limit["friction"]),
        ("less depth of all stones", limit["depth"]),
    ]
    told = " and ".join(
        f"{'falls' if change >= 0.0 else 'rises'} by {percent(_SHARE * abs(change))} with {100 * _SHARE:g} % {what}"
        for what, change in changes
        if change is not None
    )
    return (
        f"the bound {told}, to first order, by its mechanism; the limit itself was not sought anew, and all else is "
        "taken as certain"
    )


def _load(load: Mapping[str, Any]) -> dict[str, str]:
    names = ("name", "limit", "limit_lost", "bound", "candidate_lowest", "held", "lost", "tilt")
    row = dict.fromkeys(names, "") | {"name": load["name"]}
    if load["kind"] == "thickness":
        return row | {"limit": _number(load["factor"])}
    if load["kind"] != "load":
        for column, end in (("limit", "least"), ("limit_lost", "greatest")):
            row[column] = "without limit" if load[end] is None else f"{1e-3 * load[end]:.4g} kN"
        return row
    for column in ("limit", "limit_lost", "bound"):
        row[column] = load["outcome"] if load[column] is None else _number(load[column])
    stood = "" if load["candidate_converged"] in (None, True) else " NOT CONVERGED"
    row["candidate_lowest"] = _number(load["candidate_lowest"]) + stood
    runs = load.get("confirmation", {})
    for column in ("held", "lost"):
        row[column] = _number(runs[column]) if runs.get(column) is not None else ""
    return row | ({"tilt": f"{load['tilt']:.3g}°"} if "tilt" in load else {})


def _part(folder: Path, number: int, load: Mapping[str, Any]) -> dict[str, Any]:
    code = load.get("code", {"code": "", "caution": "", "values": [], "checks": []})
    places = [(folder / f"{name}-{number}.png", words) for name, words in _CAPTIONS.items()]
    return {
        "name": load["name"],
        "headline": load["headline"],
        "cautions": [code["caution"]] if code["caution"] else [],
        "code": code["code"],
        "numbers": table_of("value of a code", code["values"], _value),
        "checks": table_of("check of a code", code["checks"], _check),
        "mechanism": _mechanism(load["mechanism"]["stones"]),
        "figures": [picture(place, words) for place, words in places if place.exists()],
    }


def _value(value: Mapping[str, Any]) -> dict[str, str]:
    return {
        "symbol": value["symbol"],
        "value": f"{value['value']:.4g} {value['unit']}",
        "formula": value["formula"],
        "article": value["article"],
    }


def _check(check: Mapping[str, Any]) -> dict[str, str]:
    return {
        "name": check["name"],
        "capacity": f"{check['capacity']:.4g} {check['unit']}",
        "demand": f"{check['demand']:.4g} {check['unit']}",
        "ratio": f"{check['ratio']:.2f}",
        "passed": "passed" if check["passed"] else "NOT PASSED",
        "formula": check["formula"],
        "article": check["article"],
    }


def _mechanism(stones: Sequence[Mapping[str, Any]]) -> str:
    if not stones:
        return "Nothing moves."
    named = ", ".join(stone["code"] for stone in stones[:LISTED])
    more = f" and {len(stones) - LISTED} more" if len(stones) > LISTED else ""
    return f"Moves, the fastest first: {named}{more}."


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.4g}"
