"""Stones that could not be taken in: their lines of the survey file, each with the reason, to be corrected.

What is written is itself a file of the survey's format, with the head of the survey: once corrected it can be
taken in by itself.
"""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

from moma.errors import UsageError
from survey.records import Reject

__all__ = ["MARK", "default_path", "rejects_text", "replaceable"]

MARK = b"# rejected by moma"
"""What the files begin with, or have as their second line, by which they are known again."""

_STONE = re.compile(rb"\s*stone\b")


def default_path(survey: Path) -> Path:
    """Where the rejects of a survey file go if nobody says: beside it, ``NAME.rejects.SUFFIX``."""
    suffix = survey.suffix if survey.suffix.lower() not in _SOLIDS else ".txt"
    return survey.with_name(f"{survey.stem}.rejects{suffix}")


_SOLIDS = frozenset({".obj", ".ply", ".stl", ".msh"})


def replaceable(path: Path) -> None:
    """Check that writing the file loses nothing of the user's.

    Raises
    ------
    UsageError
        if there is a file that this program has not written
    """
    if path.is_dir():
        raise UsageError("is a folder", where=str(path), remedy="name a file with --rejects")
    if path.exists():
        with path.open("rb") as file:
            if MARK not in file.read(4096):
                raise UsageError(
                    "is there already, and is not a file of rejects",
                    where=str(path),
                    remedy="move it away, or name another file with --rejects",
                )


def rejects_text(survey: Path, format: str, rejects: Sequence[Reject]) -> bytes:
    """The rejected stones of a survey file in its own format.

    Parameters
    ----------
    survey : the file
    format : name of its format
    rejects : what could not be taken in
    """
    head = [] if format == "solids" else _head_lines(survey, format)
    mark = MARK + f": {len(rejects)} of {survey.name}\n".encode("ascii", "backslashreplace")
    text = [*head[:1], mark, *head[1:]] if format == "moma" else [mark, *head]
    ordered = sorted(rejects, key=lambda one: one.spans[0].start if one.spans else 0)
    wanted = {line for one in ordered for span in one.spans for line in span} if format != "solids" else set()
    lines = dict(_picked(survey, wanted)) if wanted else {}
    for one in ordered:
        reason = " ".join(str(one.error).split())
        text.append(b"\n# " + reason.encode("ascii", "backslashreplace") + b"\n")
        text += [lines[line] for span in one.spans for line in span if line in lines]
    return b"".join(text)


def _head_lines(survey: Path, format: str) -> list[bytes]:
    """The lines that hold for all stones of a file."""
    head = []
    with survey.open("rb") as file:
        for line in _ended(file):
            if format == "moma" and _STONE.match(line):
                break
            head.append(line)
            if format == "csv" and line.strip() and not line.lstrip(b"\xef\xbb\xbf \t").startswith(b"#"):
                break
            if format not in ("moma", "csv"):
                return []
    return head


def _picked(survey: Path, wanted: set[int]) -> Iterator[tuple[int, bytes]]:
    with survey.open("rb") as file:
        for number, line in enumerate(_ended(file), start=1):
            if number in wanted:
                yield number, line


def _ended(file: BinaryIO) -> Iterator[bytes]:
    """Lines, each with a line feed at its end."""
    for line in file:
        yield line if line.endswith(b"\n") else line + b"\n"
