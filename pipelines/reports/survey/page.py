"""report.html of a survey: one page by which the surveyor decides what to measure again."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from pipelines.reports.html import picture, write_page
from pipelines.reports.survey.study import SurveyFile, SurveyStudy
from survey.quality.canon import Deviation
from survey.quality.contradictions import Contradiction
from survey.quality.courses import CourseHeight, CourseLine
from survey.quality.precision import StoneQuality
from survey.quality.remeasure import Remeasure

__all__ = ["write_survey_page"]

_MOST = 300  # rows of a table; survey.json has them all

T = TypeVar("T")
Row = tuple[str, ...]


def write_survey_page(
    path: Path,
    study: SurveyStudy,
    pictures: Mapping[str, str],
    version: str,
    photographs: Sequence[Mapping[str, Any]] = (),
) -> None:
    """Write the page and embed the pictures of its folder.

    Parameters
    ----------
    path : report.html
    study : findings
    pictures : caption of each picture by its file name, in order
    version : of the program
    photographs : sections on oriented photographs that stones were marked on
    """
    inside = {name: picture(path.parent / name, caption) for name, caption in pictures.items()}
    facade_of = {i: facade.name for facade in study.facades for i in facade.members.tolist()}
    deviation_of = {one.code: one for one in study.deviations}
    write_page(
        path,
        "survey.html",
        name=study.name,
        lead=_lead(study),
        warnings=study.warnings,
        elevations=[one for name, one in inside.items() if name.startswith("elevation")],
        beds=[one for name, one in inside.items() if name.startswith("courses")],
        residuals=[one for name, one in inside.items() if name == "residuals.png"],
        facades=len(study.facades),
        remeasures=_first(study.remeasures, _remeasure_row),
        quality=_overall(study),
        control=list(_control(study.files)),
        courses=list(_courses(study)),
        kinds=_kinds(study),
        photographs=photographs,
        located=_first(list(_located(study)), lambda row: row),
        contradictions=_first(study.contradictions, _contradiction_row),
        stones=_first(
            _by_urgency(study),
            lambda i: _stone_row(
                study.stones[i], facade_of.get(i, "–"), deviation_of.get(study.stones[i].code)
            ),
        ),
        version=version,
    )


def _located(study: SurveyStudy) -> Iterator[Row]:
    """Yield a row for each corner that was located on photographs, with the rays behind it."""
    for stone in study.stones:
        for one in stone.evidence:
            if one["role"] == "vertex":
                rays: Any = one["rays"]
                sigma: Any = one["sigma"]
                yield (
                    stone.code,
                    str(one["point"]),
                    " × ".join(f"{1e3 * value:.1f}" for value in sigma) + " mm",
                    str(one["how"]),
                    "; ".join(f"{ray['photo']} ({ray['x']:.1f}, {ray['y']:.1f})" for ray in rays),
                )


def _first(items: Sequence[T], row: Callable[[T], Row]) -> dict[str, Any]:
    """Describe the first items by a row each, and count all of them."""
    return {"rows": [row(one) for one in items[:_MOST]], "count": len(items)}


def _lead(study: SurveyStudy) -> str:
    again = len({one.code for one in study.remeasures if one.code is not None})
    made = f"{len(study.stones)} stones"
    if study.rejects:
        made += f", and {len(study.rejects)} that could not be made"
    verdict = study.quality.verdict
    return f"{made}; {again} to measure again. {verdict[:1].upper()}{verdict[1:]}."


def _remeasure_row(one: Remeasure) -> Row:
    return (one.code or "(no code)", one.reason, one.action, str(one.line) if one.line else "–")


def _contradiction_row(one: Contradiction) -> Row:
    return (one.code, one.kind, one.text, f"{one.significance:.1f} σ")


def _overall(study: SurveyStudy) -> list[tuple[str, str]]:
    quality = study.quality
    return [
        ("Files", ", ".join(one.head.path for one in study.files)),
        ("Points and corners", str(quality.points)),
        ("Left out as blunders", str(quality.blunders)),
        ("Corners off their plane, worn or bevelled", str(quality.worn)),
        ("Redundancy of all faces", str(quality.redundancy)),
        ("rms of the points about their planes", _mm(quality.rms)),
        ("Stated sigma of a coordinate", _mm(quality.sigma)),
        ("σ₀: found over stated", _plus_minus(quality.sigma0, quality.sigma0_sigma, 1.0, "", 3)),
        ("Shape of the faces", _counts(quality.shapes)),
        ("Faces known from", _counts(quality.provenances)),
        ("Depths known from", _counts(quality.depths)),
        ("Kinds", _counts(quality.kinds)),
    ]


def _control(files: Iterable[SurveyFile]) -> Iterator[dict[str, Any]]:
    """Yield the fit and the residuals of the control points of each file that has any."""
    for file in files:
        if (fit := file.transform) is None:
            continue
        rows = [
            (
                name,
                *(f"{value * 1e3:z.1f} mm" for value in residual),
                "–" if math.isnan(test) else f"{test:.2f}",
                "–" if math.isnan(limit) else f"{limit:.2f}",
                "left out as a blunder" if name in fit.rejected else "",
            )
            for name, residual, test, limit in zip(
                fit.names, fit.residuals.tolist(), fit.standardised.tolist(), fit.limits.tolist(), strict=True
            )
        ]
        yield {
            "path": file.head.path,
            "sigma0": f"{fit.sigma0:.2f}",
            "redundancy": fit.redundancy,
            "scale": f"{(fit.scale - 1.0) * 1e6:+z.0f} ± {1e6 * math.sqrt(fit.covariance[6, 6]):.0f} mm per km",
            "scale_differs": fit.scale_differs,
            "rows": rows,
        }


def _courses(study: SurveyStudy) -> Iterator[dict[str, Any]]:
    """Yield the bed lines of each facade."""
    heights = {(one.facade, one.zone, one.course): one for one in study.course_heights}
    for facade in dict.fromkeys(line.facade for line in study.courses):
        lines = [line for line in study.courses if line.facade == facade]
        tilted = lines[0].frame_sigma
        yield {
            "name": facade,
            "tilt": f"{tilted * 1e3:.2f}" if tilted else None,
            "lines": _first(lines, lambda line: _course_row(line, heights)),
        }


def _course_row(line: CourseLine, heights: Mapping[tuple[str, str | None, int], CourseHeight]) -> Row:
    code, farthest = line.worst
    height = heights.get((line.facade, line.zone, line.course))
    return (
        f"{line.course}" if line.zone is None else f"{line.zone}, {line.course}",
        str(len(line.stones)),
        f"{line.level:z.3f} m",
        _plus_minus(line.slope, line.slope_sigma, 1e3, "mm/m", 2) + _chance(line.slope_probability),
        _plus_minus(line.sag, line.sag_sigma, 1e3, "mm", 1) + _chance(line.sag_probability),
        _mm(line.rms),
        f"{farthest * 1e3:z.1f} mm, {code}",
        _mm(line.scatter) if line.evidence != "none" else "–",
        "–" if height is None else f"{height.height:.4f} ± {height.sigma:.4f} m",
        line.finding,
    )


def _kinds(study: SurveyStudy) -> list[Row]:
    return [
        (
            one.kind,
            f"{one.length:.3f} ± {one.length_scatter:.3f} m",
            f"{one.height:.3f} ± {one.height_scatter:.3f} m",
            one.source,
            ", ".join(
                f"{odd.code} ({odd.length * 1e3:+z.0f} mm long, {odd.height * 1e3:+z.0f} mm high)"
                for odd in sorted(study.deviations, key=lambda odd: -odd.worst)[:_MOST]
                if odd.kind == one.kind and odd.worst > 3.0
            )
            or "none",
        )
        for one in study.usual.values()
    ]


def _by_urgency(study: SurveyStudy) -> list[int]:
    """Return the stones to measure again first, then the others by the scatter of their points."""
    flagged = {one.code for one in study.remeasures}
    return sorted(
        range(len(study.stones)), key=lambda i: (study.stones[i].code not in flagged, -study.stones[i].rms)
    )


def _stone_row(stone: StoneQuality, facade: str, off: Deviation | None) -> Row:
    return (
        stone.code,
        stone.kind,
        "–" if stone.course is None else str(stone.course),
        facade,
        _mm(stone.rms) if stone.redundancy else "–",
        "–" if stone.sigma0 is None else f"{stone.sigma0:.2f}",
        str(stone.redundancy),
        ", ".join((*stone.blunders, *stone.worn)) or "none",
        "; ".join((stone.shape_text if stone.measured else stone.provenance, *stone.remarks)),
        f"{stone.tilt_sigma:.2f}°" if math.isfinite(stone.tilt_sigma) else "–",
        f"{stone.length:.3f} × {stone.height:.3f}"
        + (f" ± {stone.dimension_sigma:.3f} m" if math.isfinite(stone.dimension_sigma) else " m"),
        "–" if off is None else f"{off.length * 1e3:+z.0f} × {off.height * 1e3:+z.0f} mm ({off.worst:.1f} σ)",
        _depth(stone),
        f"{stone.depth_source} ({stone.depth_origin})",
    )


def _depth(stone: StoneQuality) -> str:
    if stone.depth is None:
        return "–"
    return f"{stone.depth:.3f}" + (" m" if stone.depth_sigma is None else f" ± {stone.depth_sigma:.3f} m")


def _counts(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{count} {name}" for name, count in counts.items())


def _mm(value: float) -> str:
    return "–" if not math.isfinite(value) else f"{value * 1e3:z.2f} mm"


def _plus_minus(value: float | None, sigma: float | None, scale: float, unit: str, digits: int) -> str:
    if value is None or sigma is None:
        return "–"
    return f"{value * scale:z.{digits}f} ± {sigma * scale:.{digits}f} {unit}".rstrip()


def _chance(probability: float | None) -> str:
    if probability is None:
        return ""
    return " (< 0.1 %)" if probability < 1e-3 else f" ({100.0 * probability:.1f} %)"
