"""report.html of a survey: one page by which the surveyor decides what to measure again."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from pipelines.reports.html import MAX_ROWS, Table, picture, residual_cells, table_of, write_page
from pipelines.reports.page.model import Column
from pipelines.reports.page.surveys import survey_model
from pipelines.reports.survey.campaigns import MovedStone, comparison_lines
from pipelines.reports.survey.document import finding_of
from pipelines.reports.survey.study import SurveyFile, SurveyStudy
from survey.conventions import SIGNIFICANT
from survey.quality.canon import Deviation, KindStandard
from survey.quality.contradictions import Contradiction
from survey.quality.courses import CourseHeight, CourseLine
from survey.quality.departures.beds import OddBed, WallBeds
from survey.quality.departures.depths import DoubtfulDepth
from survey.quality.departures.faces import OddStone, WallFace
from survey.quality.masonry.index import PARAMETERS, Direction, Parameter
from survey.quality.masonry.walls import MasonryQuality
from survey.quality.precision import StoneQuality
from survey.quality.remeasure import Remeasure

Row = dict[str, str]


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
    write_page(
        path,
        "survey.html",
        survey_model(study.name, study.stones, [_facades_column(study, facade_of), _again_column(study)]),
        name=study.name,
        lead=_lead(study),
        warnings=study.warnings,
        elevations=[one for name, one in inside.items() if name.startswith("elevation")],
        beds=[one for name, one in inside.items() if name.startswith("courses")],
        residuals=[one for name, one in inside.items() if name == "residuals.png"],
        facades=len(study.facades),
        plumb=[one for name, one in inside.items() if name.startswith("plumb")],
        remeasures=table_of("measure_again", study.again.rows, _remeasure_row),
        more_stones=study.again.more,
        left=study.again.left,
        movements=table_of("beds", list(_movements(study)), dict),
        faces=table_of("faces", list(_faces(study)), dict),
        odd=table_of("odd", _odd(study), dict, MAX_ROWS),
        depths=table_of("depths", study.depths, _doubt_row, MAX_ROWS),
        masonry=list(_masonry(study)),
        quality=_overall(study),
        control=list(_control(study.files)),
        courses=list(_courses(study)),
        kinds=table_of("kinds", list(study.usual.values()), partial(_kind_row, study)),
        since=None if study.since is None else list(comparison_lines(study.since)),
        displacements=table_of(
            "since", () if study.since is None else study.since.stones, _moved_row, MAX_ROWS
        ),
        photographs=photographs,
        located=table_of("evidence", list(_located(study)), dict, MAX_ROWS),
        contradictions=table_of("contradictions", study.contradictions, _contradiction_row, MAX_ROWS),
        stones=_stones(study, facade_of),
        version=version,
    )


def _moved_row(stone: MovedStone) -> Row:
    """Return the displacement of a stone since the earlier campaign."""
    x, y, z = (f"{1e3 * value:+.1f}" for value in stone.displacement.vector)
    moved = stone.displacement
    return {
        "stone": stone.code,
        "distance": f"{1e3 * moved.distance:.1f} ± {1e3 * moved.sigma:.1f}",
        "score": f"{moved.distance / moved.sigma:.1f} σ",
        "displacement": f"{x}, {y}, {z}",
        "outwards": f"{1e3 * stone.outwards:+.1f}",
        "significant": "moved" if moved.significant else "–",
    }


def _facades_column(study: SurveyStudy, facade_of: Mapping[int, str]) -> Column:
    return Column("facade", "facade", None, [facade_of.get(i) for i in range(len(study.stones))], "Stone")


def _again_column(study: SurveyStudy) -> Column:
    """Return what to measure again, and why."""
    reasons: dict[str, list[str]] = {}
    for remeasure in study.remeasures:
        reasons.setdefault(remeasure.code or "", []).append(f"{remeasure.reason}: {remeasure.action}")
    texts = ["; ".join(reasons[stone.code]) if stone.code in reasons else None for stone in study.stones]
    return Column("again", "to measure again", None, texts, "Survey")


def _located(study: SurveyStudy) -> Iterator[Row]:
    """Yield a row for each corner that was located on photographs, with the rays behind it."""
    for stone in study.stones:
        for point in stone.evidence:
            if point["role"] == "vertex":
                rays: Any = point["rays"]
                sigma: Any = point["sigma"]
                yield {
                    "stone": stone.code,
                    "point": str(point["point"]),
                    "sigma": " × ".join(f"{1e3 * value:.1f}" for value in sigma) + " mm",
                    "how": str(point["how"]),
                    "rays": "; ".join(f"{ray['photo']} ({ray['x']:.1f}, {ray['y']:.1f})" for ray in rays),
                }


def _doubt_row(doubt: DoubtfulDepth) -> Row:
    score = f"{doubt.score:.1f} σ"
    return {"stone": doubt.code, "against": doubt.against, "text": doubt.text, "score": score}


def _lead(study: SurveyStudy) -> str:
    again = len(study.again.rows) + study.again.more
    made = f"{len(study.stones)} stones"
    if study.rejects:
        made += f", and {len(study.rejects)} that could not be made"
    verdict = study.quality.verdict
    moved = [f"{_place(wall)}: {movement.text}" for wall in study.beds for movement in wall.movements]
    moved += [f"{_place(wall)}: {movement.text}" for wall in study.faces for movement in wall.movements]
    found = f" Movement: {'; '.join(moved[:3])}{', and more' if len(moved) > 3 else ''}." if moved else ""
    return f"{made}; {again} to measure again. {verdict[:1].upper()}{verdict[1:]}.{found}"


def _place(wall: WallBeds | WallFace | MasonryQuality) -> str:
    return wall.facade if wall.zone is None else f"{wall.facade}, {wall.zone}"


def _remeasure_row(remeasure: Remeasure) -> Row:
    return {
        "stone": remeasure.code or "(no code)",
        "changes": remeasure.changes or "–",
        "reason": remeasure.reason,
        "action": remeasure.action,
        "line": str(remeasure.line) if remeasure.line else "–",
    }


def _movements(study: SurveyStudy) -> Iterator[Row]:
    """Yield what the beds of each wall tell: wall, finding, age, probability, what is excluded."""
    for wall in study.beds:
        findings = [
            (movement.text, movement.dating, _percent(movement.probability)) for movement in wall.movements
        ]
        none = "not tested: too few stones" if wall.excluded is None else "no movement found"
        for text, dating, probability in findings or [(none, "–", "–")]:
            yield {
                "wall": _place(wall),
                "text": text,
                "dating": dating,
                "probability": probability,
                "excluded": _bound(wall.excluded),
            }


def _faces(study: SurveyStudy) -> Iterator[Row]:
    """Yield what the faces of each wall tell: lean of its plane, scatter, finding, probability, what is excluded."""
    for wall in study.faces:
        lean = (
            f"{math.degrees(wall.lean):z.2f} ± {math.degrees(wall.lean_sigma):.2f}°"
            if math.isfinite(wall.lean_sigma)
            else "–"
        )
        findings = [(movement.text, _percent(movement.probability)) for movement in wall.movements]
        none = "not tested" if wall.excluded is None else "no movement found"
        for text, probability in findings or [(none, "–")]:
            yield {
                "wall": _place(wall),
                "lean": lean,
                "scatter": _mm(wall.scatter),
                "text": text,
                "probability": probability,
                "excluded": _bound(wall.excluded),
                "excluded_stone": _bound(wall.excluded_stone),
            }


def _odd(study: SurveyStudy) -> list[Row]:
    odd: list[OddStone | OddBed] = [stone for face in study.faces for stone in face.odd]
    odd += [stone for wall in study.beds for stone in wall.odd]
    odd.sort(key=lambda stone: -abs(stone.amount / stone.sigma))
    return [
        {"stone": stone.code, "text": stone.text, "score": f"{abs(stone.amount / stone.sigma):.1f} σ"}
        for stone in odd
    ]


def _masonry(study: SurveyStudy) -> Iterator[dict[str, Any]]:
    """Yield of each wall the grades of the parameters, the indices and the ranges that follow."""
    for wall in study.masonry:
        strengths = wall.strengths
        yield {
            "name": _place(wall),
            "stones": len(wall.stones),
            "grades": table_of("grade", list(PARAMETERS), partial(_grade_row, wall)),
            "indices": table_of("index", list(wall.indices), partial(_index_row, wall)),
            "strengths": [
                ("compressive strength", _range(strengths["compressive_strength"], 1e6, "MPa", 1)),
                ("shear strength without pressure", _range(strengths["shear_strength"], 1e6, "MPa", 3)),
                ("Young's modulus", _range(strengths["young"], 1e9, "GPa", 2)),
            ],
        }


def _grade_row(wall: MasonryQuality, symbol: Parameter) -> Row:
    grade = wall.grades[symbol]
    return {"symbol": symbol, "parameter": PARAMETERS[symbol], "grade": grade.words, "text": grade.text}


def _index_row(wall: MasonryQuality, direction: Direction) -> Row:
    low, high = wall.indices[direction]
    return {
        "direction": direction.replace("_", " "),
        "index": f"{low:.1f} to {high:.1f}",
        "category": wall.categories[direction],
    }


def _range(ends: tuple[float, float], unit: float, name: str, digits: int) -> str:
    return f"{ends[0] / unit:.{digits}f} to {ends[1] / unit:.{digits}f} {name}"


def _bound(value: float | None) -> str:
    return "–" if value is None else f"{value * 1e3:.1f} mm"


def _percent(probability: float) -> str:
    return "< 0.01 %" if probability < 1e-4 else f"{100.0 * probability:.2f} %"


def _contradiction_row(contradiction: Contradiction) -> Row:
    return {
        "stone": contradiction.code,
        "kind": contradiction.kind,
        "text": contradiction.text,
        "significance": f"{contradiction.significance:.1f} σ",
    }


def _overall(study: SurveyStudy) -> list[tuple[str, str]]:
    quality = study.quality
    return [
        ("Files", ", ".join(file.head.path for file in study.files)),
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
            {
                "name": name,
                **residual_cells(residual),
                "standardised": "–" if math.isnan(test) else f"{test:.2f}",
                "limit": "–" if math.isnan(limit) else f"{limit:.2f}",
                "rejected": "left out as a blunder" if name in fit.rejected else "",
            }
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
            "points": table_of("control", rows, dict),
        }


def _courses(study: SurveyStudy) -> Iterator[dict[str, Any]]:
    """Yield the bed lines of each facade."""
    heights = {(height.facade, height.zone, height.course): height for height in study.course_heights}
    for facade in dict.fromkeys(line.facade for line in study.courses):
        lines = [line for line in study.courses if line.facade == facade]
        tilted = lines[0].frame_sigma
        yield {
            "name": facade,
            "tilt": f"{tilted * 1e3:.2f}" if tilted else None,
            "lines": table_of(
                "courses", lines, lambda line: _course_row(line, heights, study.beds), MAX_ROWS
            ),
        }


def _course_row(
    line: CourseLine,
    heights: Mapping[tuple[str, str | None, int], CourseHeight],
    walls: Sequence[WallBeds],
) -> Row:
    code, farthest = line.worst
    height = heights.get((line.facade, line.zone, line.course))
    return {
        "course": f"{line.course}" if line.zone is None else f"{line.zone}, {line.course}",
        "stones": str(len(line.stones)),
        "level": f"{line.level:z.3f} m",
        "slope": _plus_minus(line.slope, line.slope_sigma, 1e3, "mm/m", 2) + _chance(line.slope_probability),
        "sag": _plus_minus(line.sag, line.sag_sigma, 1e3, "mm", 1) + _chance(line.sag_probability),
        "rms": _mm(line.rms),
        "worst": f"{farthest * 1e3:z.1f} mm, {code}",
        "scatter": _mm(line.scatter) if line.evidence != "none" else "–",
        "height": "–" if height is None else f"{height.height:.4f} ± {height.sigma:.4f} m",
        "finding": finding_of(line, walls),
    }


def _kind_row(study: SurveyStudy, kind: KindStandard) -> Row:
    odd = [stone for stone in study.deviations if stone.kind == kind.kind and stone.worst > SIGNIFICANT]
    odd.sort(key=lambda stone: -stone.worst)
    named = (
        f"{stone.code} ({stone.length * 1e3:+z.0f} mm long, {stone.height * 1e3:+z.0f} mm high)"
        for stone in odd[:MAX_ROWS]
    )
    return {
        "kind": kind.kind,
        "length": f"{kind.length:.3f} ± {kind.length_scatter:.3f} m",
        "height": f"{kind.height:.3f} ± {kind.height_scatter:.3f} m",
        "source": kind.source,
        "odd": ", ".join(named) or "none",
    }


def _by_urgency(study: SurveyStudy) -> list[int]:
    """Return the stones to measure again first, then the others by the scatter of their points."""
    flagged = {remeasure.code for remeasure in study.remeasures}
    return sorted(
        range(len(study.stones)), key=lambda i: (study.stones[i].code not in flagged, -study.stones[i].rms)
    )


def _stones(study: SurveyStudy, facade_of: Mapping[int, str]) -> Table:
    """Return the table of all stones."""
    deviation_of = {deviation.code: deviation for deviation in study.deviations}

    def cells(i: int) -> Row:
        """Return the texts of a stone, by its number."""
        stone = study.stones[i]
        return _stone_row(stone, facade_of.get(i, "–"), deviation_of.get(stone.code))

    return table_of("stones", _by_urgency(study), cells, MAX_ROWS)


def _stone_row(stone: StoneQuality, facade: str, off: Deviation | None) -> Row:
    sigma = f" ± {stone.dimension_sigma:.3f}" if math.isfinite(stone.dimension_sigma) else ""
    return {
        "stone": stone.code,
        "kind": stone.kind,
        "course": "–" if stone.course is None else str(stone.course),
        "facade": facade,
        "rms": _mm(stone.rms) if stone.redundancy else "–",
        "sigma0": "–" if stone.sigma0 is None else f"{stone.sigma0:.2f}",
        "redundancy": str(stone.redundancy),
        "blunders": ", ".join((*stone.blunders, *stone.worn)) or "none",
        "shape": "; ".join((stone.shape_text if stone.measured else stone.provenance, *stone.remarks)),
        "tilt_sigma": f"{stone.tilt_sigma:.2f}°" if math.isfinite(stone.tilt_sigma) else "–",
        "length": f"{stone.length:.3f} × {stone.height:.3f}{sigma} m",
        "deviation": "–"
        if off is None
        else f"{off.length * 1e3:+z.0f} × {off.height * 1e3:+z.0f} mm ({off.worst:.1f} σ)",
        "depth": _depth(stone),
        "depth_source": f"{stone.depth_source} ({stone.depth_origin})",
    }


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
