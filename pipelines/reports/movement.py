"""report.html of comparisons and diagnoses: measured against simulated deformation, by wall and course."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from archmodel.quantities import quantities_of
from pipelines.reports.html import in_words, input_rows, millimetres, picture, ratio, write_page
from pipelines.reports.page.model import Model

_RESTS = ("equilibrium", "settled")  # outcomes whose movement is over

_BEDS = (
    "Bed lines at their heights; departure from level, exaggerated as stated. Orange: measured, bars ± one standard "
    "deviation of a corner. Blue: simulated."
)
_CAPTIONS = {
    "beds": _BEDS,
    "misfit": "Measured less simulated height of the bed of each stone over its standard deviation: pale stones are "
    "explained, dark blue ones lie lower than simulated, dark red ones higher.",
}
_WALLS = ("Wall", "Zone", "Quantity", "χ²", "χ² if nothing had moved", "Degrees of freedom")
_COURSES = (
    "Wall",
    "Zone",
    "Course",
    "Sag, measured",
    "Sag, simulated",
    "σ",
    "Slope, measured",
    "Slope, simulated",
    "σ",
)
_HYPOTHESES = (
    "Hypothesis",
    "χ²",
    "Degrees of freedom",
    "Probability",
    "AICc behind the best",
    "Amplitude",
    "Value",
    "From",
    "To",
)


def write_comparison(path: Path, summary: Mapping[str, Any], model: Model | None) -> None:
    """Write the page of a comparison and embed the pictures of its folder.

    Parameters
    ----------
    path : report.html
    summary : as in comparison.json
    model : content of the viewer
    """
    write_page(
        path,
        "movement.html",
        model,
        name=summary["scene"],
        lead=f"Measured against simulated deformation: χ² {summary['chi2']:.1f} of {summary['dof']} degrees of "
        f"freedom; {summary['chi2_still']:.1f} if nothing had moved{unrested(summary['outcome'])}.",
        cautions=summary["cautions"],
        inputs=input_rows(summary),
        warnings=(),
        version=summary["versions"]["moma"],
        versions=summary["versions"],
        figures=_figures(path.parent),
        tables=[
            ("Walls", _WALLS, [_wall(wall) for wall in summary["walls"]]),
            ("Courses", (*_COURSES, *_results()), [_course(course) for course in summary["courses"]]),
        ],
        notes=(),
    )


def write_diagnosis_page(path: Path, name: str, summary: Mapping[str, Any], model: Model | None) -> None:
    """Write the page of a diagnosis and embed the pictures of its folder; `summary` as in diagnosis.json."""
    dating = summary["dating"]
    notes = [] if dating is None else [dating["verdict"], *dating["evidence"]]
    write_page(
        path,
        "movement.html",
        model,
        name=name,
        lead=summary["verdict"],
        cautions=summary["cautions"],
        inputs=input_rows(summary),
        warnings=(),
        version=summary["versions"]["moma"],
        versions=summary["versions"],
        figures=_figures(path.parent),
        tables=[
            (
                "Hypotheses",
                _HYPOTHESES,
                [row for hypothesis in summary["hypotheses"] for row in _hypothesis(hypothesis)],
            ),
            (
                "Walls and courses",
                (*_WALLS[:3], "Course", *_WALLS[3:]),
                [_group(group) for group in summary["groups"]],
            ),
        ],
        notes=notes,
    )


def unrested(outcome: str) -> str:
    """Return the doubt that a run casts on its movement which did not come to rest; nothing after one that did."""
    return "" if outcome in _RESTS else f"; but the stones did not come to rest: {outcome}"


def _figures(folder: Path) -> list[dict[str, str]]:
    return [
        picture(one, words)
        for name, words in _CAPTIONS.items()
        for one in sorted(folder.glob(f"{name}-*.png"))
    ]


def _wall(wall: Mapping[str, Any]) -> tuple[str, ...]:
    return (
        wall["facade"],
        wall["zone"] or "–",
        wall["quantity"],
        f"{wall['chi2']:.1f}",
        f"{wall['chi2_still']:.1f}",
        str(wall["dof"]),
    )


def _group(group: Mapping[str, Any]) -> tuple[str, ...]:
    wall = _wall(group)
    return (*wall[:3], "–" if group["course"] is None else str(group["course"]), *wall[3:])


def _course(course: Mapping[str, Any]) -> tuple[str, ...]:
    slope = course["slope"]
    return (
        course["facade"],
        course["zone"] or "–",
        str(course["course"]),
        *(
            "–" if course[key] is None else millimetres(course[key])
            for key in ("measured", "simulated", "sigma")
        ),
        *(f"{1e3 * slope[key]:z.3g} mm/m" for key in ("measured", "simulated", "sigma")),
        *(
            in_words(course["results"][name], quantity.unit) if name in course["results"] else "–"
            for name, quantity in quantities_of("course").items()
        ),
    )


def _results() -> list[str]:
    """Return the headings of the simulated results of courses."""
    labels = (quantity.label for quantity in quantities_of("course").values())
    return [f"{label[:1].upper()}{label[1:]}" for label in labels]


def _hypothesis(hypothesis: Mapping[str, Any]) -> list[tuple[str, ...]]:
    head = (
        hypothesis["name"] + (f", stood: {', '.join(hypothesis['stood'])}" if hypothesis["stood"] else ""),
        ratio(hypothesis["chi2"]),
        str(hypothesis["dof"]),
        ratio(hypothesis["probability"]),
        ratio(hypothesis["behind"]),
    )
    return [
        (
            *head,
            amplitude["name"],
            f"{amplitude['value']:.4g} {amplitude['unit']}",
            ratio(amplitude["low"]),
            ratio(amplitude["high"]),
        )
        for amplitude in hypothesis["amplitudes"]
    ] or [(*head, "–", "–", "–", "–")]
