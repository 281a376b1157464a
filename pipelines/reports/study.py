"""report.html of a study: probability with both bounds, what decides, what to measure next, what was certain."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pipelines.reports.html import percent, picture, table_of, write_page
from survey.conventions import LARGEST

_CAPTIONS = {
    "histogram": "Samples of the quantity, and the share of them that is below each value.",
    "weighted": "Samples about the design points (grey), and the probability that they stand for (line).",
    "fragility": "Probability of failure at each level, the cumulative curve, with its interval.",
    "tornado": "Share of the variance by what the stones have in common, and by the scatter of each.",
    "elevation": "Variance that the best measurement of each stone would take away.",
}


def write_study(path: Path, summary: Mapping[str, Any], pictures: Sequence[str]) -> None:
    """Write the page and embed pictures of its folder.

    Parameters
    ----------
    path : report.html
    summary : as in study.json
    pictures : names of PNG files beside it
    """
    write_page(
        path,
        "study.html",
        None,
        name=summary["scene"],
        lead=f"{summary['headline']}.",
        cautions=summary["cautions"],
        warnings=(),
        version=summary["versions"]["moma"],
        versions=summary["versions"],
        numbers=_numbers(summary),
        shares=table_of("shares", _sorted(summary["shares"]["by_input"]), _share),
        designs=table_of("designs", list(enumerate(summary["designs"], start=1)), _design),
        sobol=table_of("sobol", summary["sobol"], _indices),
        actions=table_of(
            "actions",
            summary["actions"],
            lambda action: {"text": action["text"], "share": percent(action["share"])},
            LARGEST,
        ),
        certain=summary["certain"],
        figures=[picture(path.parent / name, _CAPTIONS[Path(name).stem]) for name in pictures],
    )


def _numbers(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    failure, study = summary["failure"], summary["study"]
    rows = [("Method", study["method"]), ("Unknowns", str(summary["unknowns"]))]
    if failure is not None:
        rows += [
            (
                "Fails",
                f"{summary['quantity']} {'above' if failure['above'] else 'below'} {failure['level']:g}",
            ),
            ("Probability of failure", f"{failure['probability']:.3g}"),
            ("… if all samples without an answer fall", f"{failure['probability_upper']:.3g}"),
            (
                f"Interval of {100 * study['confidence']:g} %",
                f"{failure['low']:.3g} to {failure['high']:.3g}",
            ),
            (
                "Reliability index β",
                f"{failure['index']:.3f} ({failure['index_low']:.3f} to {failure['index_high']:.3f})",
            ),
            (
                "Samples about the design points" if summary["designs"] else "Samples",
                f"{failure['count']}, of which {failure['failing']} fail and {failure['unknown']} have no answer",
            ),
        ]
    for name, mean in summary["means"].items():
        rows.append((f"Mean of {name}", _interval(mean)))
        if mean["sigma"] is not None:
            rows.append((f"Standard deviation of {name}", f"{mean['sigma']:.4g}"))
    linear = summary["linear"]
    if linear is not None and not summary["designs"]:
        rows.append(
            ("First order at the mean", f"{linear['mean']:.4g}, standard deviation {linear['sigma']:.4g}")
        )
    return rows


def _interval(mean: Mapping[str, Any]) -> str:
    if mean["low"] is None or mean["high"] is None:
        return f"{mean['value']:.5g}, by first order"
    return f"{mean['value']:.5g} ({mean['low']:.5g} to {mean['high']:.5g})"


def _sorted(shares: Mapping[str, float]) -> list[tuple[str, float]]:
    return sorted(shares.items(), key=lambda row: -row[1])


def _share(share: tuple[str, float]) -> dict[str, str]:
    return {"input": share[0], "share": percent(share[1])}


def _indices(row: Mapping[str, Any]) -> dict[str, str]:
    """Return both Sobol' indices of an input with their intervals."""

    def index(name: str) -> str:
        """Return an index with its interval."""
        low, high = row[f"{name}_interval"]
        return f"{row[name]:.4f} ({low:.3f} to {high:.3f})"

    return {"input": row["input"], "first": index("first"), "total": index("total")}


def _design(numbered: tuple[int, Mapping[str, Any]]) -> dict[str, str]:
    number, design = numbered
    stands = "" if design["converged"] else " NOT CONVERGED"
    values = (f"{row['label']} {row['value']:.4g} ({row['sigmas']:+.2f} σ)" for row in design["unknowns"][:4])
    return {
        "number": str(number),
        "index": f"{design['index']:.3f}{stands}",
        "probability": f"{design['probability']:.3g}",
        "unknowns": ", ".join(values),
    }
