"""report.html of comparisons and diagnoses: measured against simulated deformation, by wall and course."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from archmodel.quantities import quantities_of
from pipelines.reports.html import in_words, input_rows, millimetres, picture, ratio, table_of, write_page
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
            ("Walls", table_of("compared wall", summary["walls"], _wall)),
            ("Courses", table_of(("compared course", "course"), summary["courses"], _course)),
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
            ("Hypotheses", table_of("hypothesis", list(_amplitudes(summary["hypotheses"])), _hypothesis)),
            ("Walls and courses", table_of("compared wall", summary["groups"], _wall)),
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


def _wall(wall: Mapping[str, Any]) -> dict[str, str]:
    """Return the misfit of a wall, or of a course of it where there is a key for one."""
    return {
        "facade": wall["facade"],
        "zone": wall["zone"] or "–",
        "quantity": wall["quantity"],
        **({"course": "–" if wall["course"] is None else str(wall["course"])} if "course" in wall else {}),
        "chi2": f"{wall['chi2']:.1f}",
        "chi2_still": f"{wall['chi2_still']:.1f}",
        "dof": str(wall["dof"]),
    }


def _course(course: Mapping[str, Any]) -> dict[str, str]:
    ends = ("measured", "simulated", "sigma")
    return {
        "facade": course["facade"],
        "zone": course["zone"] or "–",
        "course": str(course["course"]),
        **{key: "–" if course[key] is None else millimetres(course[key]) for key in ends},
        **{f"slope_{key}": f"{1e3 * course['slope'][key]:z.3g} mm/m" for key in ends},
        **{
            name: in_words(course["results"][name], quantity.unit) if name in course["results"] else "–"
            for name, quantity in quantities_of("course").items()
        },
    }


def _amplitudes(
    hypotheses: Sequence[Mapping[str, Any]],
) -> Iterator[tuple[Mapping[str, Any], Mapping[str, Any]]]:
    """Yield each amplitude with its hypothesis; of a hypothesis without any, nothing of one."""
    for hypothesis in hypotheses:
        for amplitude in hypothesis["amplitudes"] or [{}]:
            yield hypothesis, amplitude


def _hypothesis(row: tuple[Mapping[str, Any], Mapping[str, Any]]) -> dict[str, str]:
    hypothesis, amplitude = row
    stood = f", stood: {', '.join(hypothesis['stood'])}" if hypothesis["stood"] else ""
    cells = {
        "name": hypothesis["name"] + stood,
        "chi2": ratio(hypothesis["chi2"]),
        "dof": str(hypothesis["dof"]),
        "probability": ratio(hypothesis["probability"]),
        "behind": ratio(hypothesis["behind"]),
    }
    if not amplitude:
        return cells | dict.fromkeys(("amplitude", "value", "low", "high"), "–")
    return cells | {
        "amplitude": amplitude["name"],
        "value": f"{amplitude['value']:.4g} {amplitude['unit']}",
        "low": ratio(amplitude["low"]),
        "high": ratio(amplitude["high"]),
    }
