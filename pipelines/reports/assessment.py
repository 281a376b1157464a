"""report.html of an assessment: what decides, what each number is, checks by a code, mechanisms."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pipelines.reports.html import input_rows, picture, write_page
from pipelines.reports.page.model import Model

__all__ = ["write_assessment"]

_HEAD = ("Question", "Bound or least", "Candidate or greatest", "Held", "Lost", "Tilt")
_VALUES = ("Symbol", "Value", "Formula", "Article")
_CHECKS = ("Check", "Capacity", "Demand", "Ratio", "Verdict", "Formula", "Article")
_CAPTIONS = {
    "mechanism": "As the stones begin to move, exaggerated.",
    "pushover": "What the stones bear as one of them is led to collapse.",
    "forces": "Resultants of the joints at the limit: blue within the kern, red outside.",
}
_FEW = 12  # stones of a mechanism that are named


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
        lead=f"{summary['headline']}. {summary['free']} stones that may move, {summary['contacts']} contact points, "
        f"weight {1e-3 * summary['weight']:.2f} kN.",
        cautions=summary["cautions"],
        inputs=input_rows(summary),
        warnings=(),
        version=summary["versions"]["moma"],
        versions=summary["versions"],
        head=_HEAD,
        loads=[_row(one) for one in loads],
        value_head=_VALUES,
        check_head=_CHECKS,
        parts=[_part(path.parent, number, one) for number, one in enumerate(loads, start=1)],
    )


def _row(one: Mapping[str, Any]) -> tuple[str, ...]:
    if one["kind"] == "thickness":
        return (one["name"], _number(one["factor"]), "", "", "", "")
    if one["kind"] != "load":
        ends = (
            "without limit" if one[end] is None else f"{1e-3 * one[end]:.4g} kN"
            for end in ("least", "greatest")
        )
        return (one["name"], *ends, "", "", "")
    runs = one.get("confirmation", {})
    tilt = f"{one['tilt']:.3g}°" if "tilt" in one else ""
    bound = one["outcome"] if one["bound"] is None else _number(one["bound"])
    held, lost = (_number(runs[end]) if runs.get(end) is not None else "" for end in ("held", "lost"))
    stood = "" if one["candidate_converged"] in (None, True) else " NOT CONVERGED"
    return (one["name"], bound, _number(one["candidate"]) + stood, held, lost, tilt)


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
