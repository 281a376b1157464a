"""report.html of a survey: one page for the surveyor, who decides by it what to measure again."""

import math
from collections.abc import Iterable, Mapping
from html import escape
from pathlib import Path

from pipelines.reports.html import figure, page, table
from pipelines.reports.survey.study import SurveyFile, SurveyStudy
from survey.quality.canon import Deviation
from survey.quality.courses import CourseHeight, CourseLine
from survey.quality.precision import StoneQuality

__all__ = ["write_survey_page"]

_MOST = 300  # rows of a table; survey.json has them all

_HEADS = {
    "remeasure": ("Stone", "Why", "What to do", "Line"),
    "stones": (
        "Stone", "Kind", "Course", "Facade", "rms", "σ₀", "Redundancy", "Left out", "Face", "Tilt σ",
        "Length × height", "Off the usual", "Depth", "Evidence for the depth",
    ),
    "courses": (
        "Course", "Stones", "Bed at", "Slope (chance)", "Mid-span over chord (chance)", "rms", "Farthest corner",
        "Beds scatter by", "Height to next bed", "Finding",
    ),
    "kinds": ("Kind", "Length", "Height", "Evidence", "Stones beyond 3 σ"),
    "control": ("Control point", "Residual in x", "y", "z", "Test", "Limit", ""),
}  # fmt: skip


def write_survey_page(path: Path, study: SurveyStudy, pictures: Mapping[str, str], version: str) -> None:
    """Write the page, with the pictures that lie in its folder inside it.

    Parameters
    ----------
    path : report.html
    study : what was found
    pictures : file name of each picture and its caption, in order
    version : of the program
    """
    inside = {name: figure(path.parent / name, caption) for name, caption in pictures.items()}
    elevations = [text for name, text in inside.items() if name.startswith("elevation")]
    beds = [text for name, text in inside.items() if name.startswith("courses")]
    body = [
        f"<h1>{escape(study.name)}</h1>",
        f'<p class="lead">{_lead(study)}</p>',
        *(f'<p class="warning">{escape(warning)}</p>' for warning in study.warnings),
        *elevations,
        *(
            [f"<p>Pictures of the {len(elevations)} largest of {len(study.facades)} facades.</p>"]
            if len(elevations) < len(study.facades)
            else []
        ),
        "<h2>What to measure again</h2>",
        *_remeasures(study),
        "<h2>How precise the points are</h2>",
        *(text for name, text in inside.items() if name == "residuals.png"),
        table(_overall(study)),
        *_control(study.files),
        "<h2>Courses</h2>",
        *beds,
        *_courses(study),
        "<h2>Kinds: theory and measurement</h2>",
        *_kinds(study),
        "<h2>Stones</h2>",
        *_stones(study),
        f"<p>Made by MOMA {escape(version)}.</p>",
    ]
    path.write_text(page(f"{study.name}: survey report", body), encoding="utf-8")


def _lead(study: SurveyStudy) -> str:
    again = len({one.code for one in study.remeasures if one.code is not None})
    made = f"{len(study.stones)} stones"
    if study.rejects:
        made += f", and {len(study.rejects)} that could not be made"
    return escape(
        f"{made}; {again} to measure again. {study.quality.verdict[:1].upper()}{study.quality.verdict[1:]}."
    )


def _remeasures(study: SurveyStudy) -> list[str]:
    if not study.remeasures:
        return ["<p>Nothing: every face is checked by more points than it needs, and they agree.</p>"]
    rows = [
        (one.code or "(no code)", one.reason, one.action, str(one.line) if one.line else "–")
        for one in study.remeasures[:_MOST]
    ]
    return [
        "<p>Most urgent first.</p>",
        _wide(table(rows, _HEADS["remeasure"])),
        *_more(len(study.remeasures)),
    ]


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


def _control(files: Iterable[SurveyFile]) -> list[str]:
    """Residuals of the control points of each file that has any."""
    out = []
    for file in files:
        if (fit := file.transform) is None:
            continue
        rows = [
            (
                name,
                *(f"{value * 1e3:.1f} mm" for value in residual),
                "–" if math.isnan(test) else f"{test:.2f}",
                "–" if math.isnan(limit) else f"{limit:.2f}",
                "left out as a blunder" if name in fit.rejected else "",
            )
            for name, residual, test, limit in zip(
                fit.names, fit.residuals.tolist(), fit.standardised.tolist(), fit.limits.tolist(), strict=True
            )
        ]
        scale = f"{(fit.scale - 1.0) * 1e6:+.0f} ± {1e6 * math.sqrt(fit.covariance[6, 6]):.0f} mm per km"
        words = (
            f"{len(rows)} control points tie {file.head.path} to the site: σ₀ {fit.sigma0:.2f} with redundancy "
            f"{fit.redundancy}. The scale differs from 1 by {scale}, "
            f"{'more than chance would have it' if fit.scale_differs else 'no more than chance'}. Residuals are site "
            "minus transformed coordinates; the test is their length in standard deviations, which a sound point "
            "keeps below the limit."
        )
        out += [f"<p>{escape(words)}</p>", table(rows, _HEADS["control"])]
    return out


def _courses(study: SurveyStudy) -> list[str]:
    if not study.courses:
        return ["<p>No stone of a standing wall has the number of a course.</p>"]
    heights = {(one.facade, one.zone, one.course): one for one in study.course_heights}
    out = [
        "<p>Of the lower corners of each course: how the straight line through them rises to the right of the "
        "viewer, and how high the best parabola stands over its chord at mid-span, negative where it sags. The "
        "chance is that of so much in a level, straight course whose beds scatter as these do; below 1 % it "
        "is called a finding. Corners off their plane are left out. Where a wall is round, distances are those on "
        "the mean plane of the facade.</p>"
    ]
    for facade in dict.fromkeys(line.facade for line in study.courses):
        lines = [line for line in study.courses if line.facade == facade]
        tilted = lines[0].frame_sigma
        words = f"Control points hold the frame level to ± {tilted * 1e3:.2f} mm/m along it, which is part of each ±."
        out += [f"<h3>{escape(facade)}</h3>", f"<p>{words}</p>" if tilted else ""]
        rows = [_course_row(line, heights) for line in lines[:_MOST]]
        out += [_wide(table(rows, _HEADS["courses"])), *_more(len(lines))]
    return out


def _course_row(
    line: CourseLine, heights: Mapping[tuple[str, str | None, int], CourseHeight]
) -> tuple[str, ...]:
    code, farthest = line.worst
    height = heights.get((line.facade, line.zone, line.course))
    return (
        f"{line.course}" if line.zone is None else f"{line.zone}, {line.course}",
        str(len(line.stones)),
        f"{line.level:.3f} m",
        _plus_minus(line.slope, line.slope_sigma, 1e3, "mm/m", 2) + _chance(line.slope_probability),
        _plus_minus(line.sag, line.sag_sigma, 1e3, "mm", 1) + _chance(line.sag_probability),
        _mm(line.rms),
        f"{farthest * 1e3:.1f} mm, {code}",
        _mm(line.scatter) if line.evidence != "none" else "–",
        "–" if height is None else f"{height.height:.4f} ± {height.sigma:.4f} m",
        line.finding,
    )


def _kinds(study: SurveyStudy) -> list[str]:
    rows = [
        (
            one.kind,
            f"{one.length:.3f} ± {one.length_scatter:.3f} m",
            f"{one.height:.3f} ± {one.height_scatter:.3f} m",
            one.source,
            ", ".join(
                f"{odd.code} ({odd.length * 1e3:+.0f} mm long, {odd.height * 1e3:+.0f} mm high)"
                for odd in sorted(study.deviations, key=lambda odd: -odd.worst)[:_MOST]
                if odd.kind == one.kind and odd.worst > 3.0
            )
            or "none",
        )
        for one in study.usual.values()
    ]
    words = "The usual face of each kind ± how much stones differ from it, and the stones that differ by far more."
    odd = [
        (one.code, one.kind, f"{one.text}", f"{one.significance:.1f} σ")
        for one in study.contradictions[:_MOST]
    ]
    told = (
        [table(odd, ("Stone", "Called", "But", "Significance")), *_more(len(study.contradictions))]
        if odd
        else ["<p>No stone's measured proportions contradict its kind.</p>"]
    )
    return [f"<p>{words}</p>", table(rows, _HEADS["kinds"]) if rows else "", *told]


def _stones(study: SurveyStudy) -> list[str]:
    """Those to measure again first, then those whose points scatter most."""
    flagged = {one.code for one in study.remeasures}
    facade_of = {i: facade.name for facade in study.facades for i in facade.members.tolist()}
    order = sorted(
        range(len(study.stones)), key=lambda i: (study.stones[i].code not in flagged, -study.stones[i].rms)
    )
    off = {one.code: one for one in study.deviations}
    rows = [
        _stone_row(study.stones[i], facade_of.get(i, "–"), off.get(study.stones[i].code))
        for i in order[:_MOST]
    ]
    if not rows:
        return ["<p>None.</p>"]
    words = "Those to measure again first, then those whose points scatter most."
    return [f"<p>{words}</p>", _wide(table(rows, _HEADS["stones"])), *_more(len(order))]


def _stone_row(stone: StoneQuality, facade: str, off: Deviation | None) -> tuple[str, ...]:
    return (
        stone.code,
        stone.kind,
        "–" if stone.course is None else str(stone.course),
        facade,
        _mm(stone.rms) if stone.redundancy else "–",
        "–" if stone.sigma0 is None else f"{stone.sigma0:.2f}",
        str(stone.redundancy),
        ", ".join((*stone.blunders, *stone.worn)) or "none",
        stone.shape_text if stone.measured else stone.provenance,
        f"{stone.tilt_sigma:.2f}°" if math.isfinite(stone.tilt_sigma) else "–",
        f"{stone.length:.3f} × {stone.height:.3f}"
        + (f" ± {stone.dimension_sigma:.3f} m" if math.isfinite(stone.dimension_sigma) else " m"),
        "–" if off is None else f"{off.length * 1e3:+.0f} × {off.height * 1e3:+.0f} mm ({off.worst:.1f} σ)",
        _depth(stone),
        f"{stone.depth_source} ({stone.depth_origin})",
    )


def _depth(stone: StoneQuality) -> str:
    if stone.depth is None:
        return "–"
    return f"{stone.depth:.3f}" + (" m" if stone.depth_sigma is None else f" ± {stone.depth_sigma:.3f} m")


def _more(count: int) -> list[str]:
    return [f"<p>The first {_MOST} of {count}; survey.json has them all.</p>"] if count > _MOST else []


def _wide(text: str) -> str:
    return f'<div class="wide">{text}</div>'


def _counts(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{count} {name}" for name, count in counts.items())


def _mm(value: float) -> str:
    return "–" if not math.isfinite(value) else f"{value * 1e3:.2f} mm"


def _plus_minus(value: float | None, sigma: float | None, scale: float, unit: str, digits: int) -> str:
    if value is None or sigma is None:
        return "–"
    return f"{value * scale:.{digits}f} ± {sigma * scale:.{digits}f} {unit}".rstrip()


def _chance(probability: float | None) -> str:
    if probability is None:
        return ""
    return " (< 0.1 %)" if probability < 1e-3 else f" ({100.0 * probability:.1f} %)"
