"""Writing the native survey format, as `survey.formats.moma_ascii` reads it."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from moma.errors import SurveyError
from survey.records import OBSERVER, BlockRecord, Survey

__all__ = ["MAGIC", "write_moma"]

MAGIC = "moma-survey 1"


def write_moma(survey: Survey, path: Path) -> None:
    """Write a survey in the native format; what is read back is equal to the last bit.

    Parameters
    ----------
    survey : what to write
    path : the file; it is replaced

    Raises
    ------
    SurveyError
        if a name, note or source has characters that do not fit on a line
    """
    lines = [MAGIC, f"name {survey.head.name}"]
    lines += [f"{OBSERVER} {_row(one.position)}" for one in survey.head.stations if one.name == OBSERVER]
    lines += [
        f"depth {rule.kind} {_depth_text(rule.depth, rule.sigma, rule.source)}"
        for rule in survey.head.depth_rules
    ]
    sigmas = [block.sigma for block in survey.blocks]
    common = max(sorted(set(sigmas)), key=sigmas.count)
    lines.append(f"sigma {_number(common)}")
    for block in survey.blocks:
        lines += ["", *_stone_lines(block, common)]
    for line in lines:
        if not line.isprintable():
            raise SurveyError(
                f"{line[:60]!r} cannot be written", where=str(path), remedy="keep names and notes to one line"
            )
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def _stone_lines(block: BlockRecord, common_sigma: float) -> list[str]:
    course = "" if block.course is None else f" course {block.course}"
    lines = [f"stone {block.code} {block.kind}{course}"]
    if block.sigma != common_sigma:
        lines.append(f"  sigma {_number(block.sigma)}")
    if block.depth is not None:
        source = block.depth_source or "not stated"
        lines.append(f"  depth {_depth_text(block.depth, block.depth_sigma, source)}")
    lines += [f"  note {key} {text}" for key, text in block.notes.items()]
    lines += [f"  vertex {_row(vertex)}" for vertex in block.vertices]
    lines += [f"  point {_row(point)}" for point in block.points]
    return [*lines, "end"]


def _depth_text(depth: float, sigma: float | None, source: str) -> str:
    precision = "" if sigma is None else f" sigma {_number(sigma)}"
    return f"{_number(depth)}{precision} source {source}"


def _row(values: NDArray[np.float64]) -> str:
    return " ".join(_number(value) for value in values)


def _number(value: float) -> str:
    """Shortest of: four decimals when they say it all, else every digit."""
    fixed = f"{value:.4f}"
    return fixed if float(fixed) == value else repr(float(value))
