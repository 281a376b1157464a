"""report.html of an assessment: what decides, what each number is, checks by a code, mechanisms."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pipelines.reports.html import direction_text, input_rows, kilonewtons, percent, picture, write_page
from pipelines.reports.page.model import Model
from pipelines.results.wall_axes import WallAxes, axes_of

__all__ = ["write_assessment"]

_HEAD = (
    "Question",
    "Held or least",
    "Lost or greatest",
    "Bound",
    "Lowest candidate",
    "Runs hold",
    "Runs lose",
    "Tilt",
)
_VALUES = ("Symbol", "Value", "Formula", "Article")
_CHECKS = ("Check", "Capacity", "Demand", "Ratio", "Verdict", "Formula", "Article")
_CAPTIONS = {
    "mechanism": "As the stones begin to move, exaggerated.",
    "pushover": "What the stones bear as one of them is led to collapse.",
    "forces": "Resultants of the joints at the limit: blue within the kern, red outside.",
}
_FEW = 12  # stones of a mechanism that are named
_SHARE = 0.1  # change of friction and depth by which the sensitivity of a limit is told [-]


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
        head=_HEAD,
        loads=[_row(load) for load in loads],
        value_head=_VALUES,
        check_head=_CHECKS,
        parts=[_part(path.parent, number, load) for number, load in enumerate(loads, start=1)],
    )


def _lead(summary: Mapping[str, Any]) -> str:
    """Return the push that governs in a sentence: its direction, capacity and demand; nothing of other questions."""
    one, axes = summary["loads"][summary["governs"]], axes_of(summary["wall"])
    if "direction" not in one or "tilt" not in one or not one.get("limit"):
        return ""
    text = f"Pushed {direction_text(axes, one['direction'])}, the stones hold {100 * one['limit']:.4g} % of their "
    text += f"weight, {kilonewtons(one['limit'] * summary['weight'])}"
    if one["limit_lost"] is not None:
        text += f", and fall at {100 * one['limit_lost']:.4g} %"
    return f"{text}. Capacity against demand: {_demand(one)}. "


def _governs(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return what governs in words: direction, capacity against demand, mechanism, and how sure it is."""
    one, axes = summary["loads"][summary["governs"]], axes_of(summary["wall"])
    rows = [("Load", one["name"])]
    if "direction" in one:
        rows.append(("Direction", direction_text(axes, one["direction"])))
    if one["kind"] == "load" and (limit := one.get("limit")):
        push = "direction" in one and "tilt" in one
        force = f": {kilonewtons(limit * summary['weight'])} on all stones that may move" if push else ""
        rows += [("Capacity", f"λ = {_number(limit)}{force}"), ("Capacity against demand", _demand(one))]
    if stones := one["mechanism"]["stones"]:
        rows.append(("How it falls", _place(axes, stones)))
    rows.append(("How sure it is", _sure(one.get("sensitivity"))))
    return rows


def _demand(one: Mapping[str, Any]) -> str:
    """Return the comparisons of a code in words."""
    if "code" not in one:
        return "no demand was stated: --code with a table [site] compares this load with that of a code"
    return "; ".join(
        f"{check['name']}: {check['capacity']:.4g} against {check['demand']:.4g} {check['unit']}, ratio "
        f"{check['ratio']:.2f}, {'passed' if check['passed'] else 'NOT PASSED'}"
        for check in one["code"]["checks"]
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


def _sure(found: Mapping[str, Any] | None) -> str:
    """Return by how much the bound changes with friction and depth, to first order."""
    if found is None:
        return "friction, depths and densities are taken as certain"
    changes = [
        ("less friction in all joints", found["friction"]),
        ("less depth of all stones", found["depth"]),
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


def _row(one: Mapping[str, Any]) -> tuple[str, ...]:
    if one["kind"] == "thickness":
        return (one["name"], _number(one["factor"]), *[""] * 6)
    if one["kind"] != "load":
        ends = (
            "without limit" if one[end] is None else f"{1e-3 * one[end]:.4g} kN"
            for end in ("least", "greatest")
        )
        return (one["name"], *ends, *[""] * 5)
    runs = one.get("confirmation", {})
    tilt = f"{one['tilt']:.3g}°" if "tilt" in one else ""
    bound = one["outcome"] if one["bound"] is None else _number(one["bound"])
    held, lost = (_number(runs[end]) if runs.get(end) is not None else "" for end in ("held", "lost"))
    limit, too_much = (
        one["outcome"] if one[key] is None else _number(one[key]) for key in ("limit", "limit_lost")
    )
    stood = "" if one["candidate_converged"] in (None, True) else " NOT CONVERGED"
    return (one["name"], limit, too_much, bound, _number(one["candidate_lowest"]) + stood, held, lost, tilt)


def _part(folder: Path, number: int, one: Mapping[str, Any]) -> dict[str, Any]:
    code = one.get("code", {"code": "", "caution": "", "values": [], "checks": []})
    places = [(folder / f"{name}-{number}.png", words) for name, words in _CAPTIONS.items()]
    return {
        "name": one["name"],
        "headline": one["headline"],
        "cautions": [code["caution"]] if code["caution"] else [],
        "code": code["code"],
        "numbers": [
            (value["symbol"], f"{value['value']:.4g} {value['unit']}", value["formula"], value["article"])
            for value in code["values"]
        ],
        "checks": [
            (
                check["name"],
                f"{check['capacity']:.4g} {check['unit']}",
                f"{check['demand']:.4g} {check['unit']}",
                f"{check['ratio']:.2f}",
                "passed" if check["passed"] else "NOT PASSED",
                check["formula"],
                check["article"],
            )
            for check in code["checks"]
        ],
        "mechanism": _mechanism(one["mechanism"]["stones"]),
        "figures": [picture(place, words) for place, words in places if place.exists()],
    }


def _mechanism(stones: Sequence[Mapping[str, Any]]) -> str:
    if not stones:
        return "Nothing moves."
    named = ", ".join(stone["code"] for stone in stones[:_FEW])
    more = f" and {len(stones) - _FEW} more" if len(stones) > _FEW else ""
    return f"Moves, the fastest first: {named}{more}."


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.4g}"
