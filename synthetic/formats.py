"""Writers of surveys: the native format, as `survey.formats.native.reader` reads it back, and closed solids as OBJ."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from ground.errors import SurveyError
from ground.tables.numbers import FARTHEST
from survey.formats.fields import CODE
from survey.formats.native.reader import MAGIC
from survey.records.survey import (
    OBSERVER,
    BlockRecord,
    ControlPoint,
    DepthRule,
    Extrusion,
    Photograph,
    SolidRecord,
    Survey,
    SurveyHead,
)


def write_moma(survey: Survey, path: Path) -> None:
    """Write a survey in the native format; it is read back equal to the last bit.

    Point numbers of an instrument are left out: the format has no place for them.

    Parameters
    ----------
    survey : with one stone or more
    path : the file; it is replaced

    Raises
    ------
    SurveyError
        if a name, note or source has characters that do not fit on a line, or a number cannot be written
    """
    if not survey.blocks:
        raise SurveyError(
            "the survey has no stones", where=str(path), remedy="write surveys of one stone or more"
        )
    sigmas = (block.sigma for block in survey.blocks if block.sigmas is None and block.sigma > 0.0)
    counts = Counter(sigmas) or Counter([0.003])
    common = max(sorted(counts), key=counts.__getitem__)
    _write(Path(path), _survey_lines(survey, common))


def write_head(head: SurveyHead, path: Path) -> None:
    """Write a header file, for formats without a head of their own.

    Parameters
    ----------
    head : of the survey
    path : the file; it is replaced

    Raises
    ------
    SurveyError
        if a name or source has characters that do not fit on a line, or a number cannot be written
    """
    _write(Path(path), _head_lines(head))


def _write(path: Path, lines: Iterable[str]) -> None:
    try:
        text = "\n".join([MAGIC, *lines]) + "\n"
    except SurveyError as error:
        raise error.at(str(path)) from error
    path.write_text(text, encoding="utf-8", newline="\n")


def _survey_lines(survey: Survey, common_sigma: float) -> Iterator[str]:
    yield from _head_lines(survey.head)
    yield f"sigma {_number(common_sigma)}"
    for block in survey.blocks:
        yield ""
        yield from _stone_lines(block, common_sigma)


def _head_lines(head: SurveyHead) -> Iterator[str]:
    yield f"name {_text(head.name)}"
    for station in head.stations:
        word = OBSERVER if station.name == OBSERVER else f"station {_name(station.name)}"
        yield f"{word} {_row(station.position)}"
    yield from map(_control_line, head.control)
    for photograph in head.photographs:
        yield from _photograph_lines(photograph)
    yield from map(_rule_line, head.depth_rules)
    for canon in head.canons:
        size = f"{_number(canon.length)} {_number(canon.height)} sigma {_number(canon.sigma)}"
        yield f"canon {canon.kind} {size} source {_text(canon.source)}"
    if head.orientation is not None:
        yield f"orientation {_text(head.orientation)}"
    if head.roughness is not None:
        yield f"roughness {_number(head.roughness) if head.roughness else 0}"
    for surface in head.surfaces:
        scatter = "" if surface.sigma is None else f" sigma {_number(surface.sigma)}"
        yield f"surface {_name(surface.name)} {surface.kind}{scatter}"
    if head.extrusion.direction is not None or head.extrusion.tail != 1.0:
        yield _extrusion_line(head.extrusion)


def _control_line(point: ControlPoint) -> str:
    measured = f"{_row(point.measured)} sigma {_number(point.measured_sigma)}"
    return f"control {_name(point.name)} {measured} site {_row(point.site)} sigma {_number(point.site_sigma)}"


def _photograph_lines(photograph: Photograph) -> list[str]:
    name = _name(photograph.name)
    station = "" if photograph.station is None else f" station {_name(photograph.station)}"
    lines = [f"photo {name} sigma {_number(photograph.sigma)}{station}"]
    for mark in photograph.marks:
        at = f"{_row(mark.position)} sigma {_number(mark.sigma)}"
        lines.append(f"mark {name} {_row(mark.image)} at {at}")
    return lines


def _rule_line(rule: DepthRule) -> str:
    which = rule.kind or "*"
    if rule.courses is not None:
        first, last = rule.courses
        which += f" course {first}" if first == last else f" course {first}-{last}"
    if rule.zone is not None:
        which += f" zone {_name(rule.zone)}"
    return f"depth {which} {_depth_text(rule.depth, rule.sigma, rule.source)}"


def _stone_lines(block: BlockRecord, common_sigma: float) -> list[str]:
    course = "" if block.course is None else f" course {block.course}"
    zone = "" if block.zone is None else f" zone {_name(block.zone)}"
    lines = [f"stone {block.code} {block.kind}{course}{zone}"]
    if block.sigmas is None and block.sigma not in (common_sigma, 0.0):
        lines.append(f"  sigma {_number(block.sigma)}")
    if block.station is not None:
        lines.append(f"  station {_name(block.station)}")
    if block.extrusion is not None:
        lines.append(f"  {_extrusion_line(block.extrusion)}")
    if block.depth is not None:
        source = block.depth_source or "not stated"
        lines.append(f"  depth {_depth_text(block.depth, block.depth_sigma, source)}")
    lines += [f"  note {_key(key)} {_text(text)}" for key, text in block.notes.items()]
    if block.photograph is not None:
        lines.append(f"  photo {_name(block.photograph)}")
        lines += [f"  pixel {_row(pixel)}" for pixel in block.image]
    if block.surface is not None:
        lines.append(f"  on {_name(block.surface)}")
    for mark in block.marks:
        accuracy = "" if mark.sigma is None else f" sigma {_number(mark.sigma)}"
        lines.append(
            f"  mark {_name(mark.name)} {mark.role} {_name(mark.photograph)} {_row(mark.image)}{accuracy}"
        )
    precisions = [""] * (len(block.points) + len(block.vertices))
    if block.sigmas is not None:
        precisions = [f" sigma {_number(sigma)}" for sigma in block.sigmas]
    count = len(block.points)
    lines += [
        f"  vertex {_row(vertex)}{p}" for vertex, p in zip(block.vertices, precisions[count:], strict=True)
    ]
    lines += [f"  point {_row(point)}{p}" for point, p in zip(block.points, precisions[:count], strict=True)]
    return [*lines, "end"]


def _extrusion_line(extrusion: Extrusion) -> str:
    along = "" if extrusion.direction is None else f" along {_row(extrusion.direction)}"
    return (
        f"extrude{along}"
        if along and extrusion.tail == 1.0
        else f"extrude{along} tail {_number(extrusion.tail)}"
    )


def _depth_text(depth: float, sigma: float | None, source: str) -> str:
    precision = "" if sigma is None else f" sigma {_number(sigma)}"
    return f"{_number(depth)}{precision} source {_text(source)}"


def _row(values: Iterable[float]) -> str:
    return " ".join(_number(value) for value in values)


def _number(value: float) -> str:
    """Write four decimals if they are exact, otherwise every digit."""
    if not abs(value) <= FARTHEST:
        raise SurveyError(f"{value} cannot be written", remedy="coordinates are in metres, and finite")
    fixed = f"{value:.4f}"
    return fixed if float(fixed) == value else repr(float(value))


def _text(text: str) -> str:
    """Check text that runs to the end of a line."""
    if not text or not text.isprintable() or text != text.strip():
        raise SurveyError(f"{text[:60]!r} cannot be written", remedy="keep names and notes to one line")
    return text


def _name(text: str) -> str:
    if CODE.fullmatch(text):
        return text
    if '"' in text or len(text) > 64:
        raise SurveyError(f"{text[:60]!r} cannot be written", remedy="give it a name of 64 letters at most")
    return f'"{_text(text)}"'


def _key(text: str) -> str:
    if not text or not text.isprintable() or " " in text:
        raise SurveyError(f"note {text[:60]!r} cannot be written", remedy="give a note one word as its key")
    return text


def write_obj(solids: Sequence[SolidRecord], path: Path) -> None:
    """Write solids that are read back equal to the last bit; objects are named CODE:KIND.

    Parameters
    ----------
    solids : the stones, whose courses are left out
    path : the file; it is replaced
    """
    lines, before = [], 1
    for solid in solids:
        lines.append(f"o {solid.code}:{solid.kind}")
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in solid.vertices.tolist()]
        lines += ["f " + " ".join(str(before + corner) for corner in face) for face in solid.faces]
        before += len(solid.vertices)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
