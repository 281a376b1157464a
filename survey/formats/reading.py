"""Common entry to the readers of all survey formats."""

from collections.abc import Callable, Mapping
from pathlib import Path

from moma.errors import UsageError
from survey.formats.native.reader import open_moma, read_head, with_header
from survey.formats.options import ReadingOptions, whole
from survey.formats.points.csv import open_csv
from survey.formats.points.pnezd import open_penzd, open_pnezd
from survey.records.survey import Survey, SurveyStream

__all__ = [
    "FORMATS",
    "SOLIDS",
    "Reader",
    "ReadingOptions",
    "open_survey",
    "read_head",
    "read_survey",
    "solid_files",
    "with_header",
]

Reader = Callable[[Path, ReadingOptions], SurveyStream]
"""A function that begins to read a file."""


def _open_solids(path: Path, options: ReadingOptions) -> SurveyStream:
    from survey.formats.solids.reader import open_solids  # imports trimesh, which takes half a second

    return open_solids(path, options)


def solid_files(folder: Path) -> tuple[Path, ...]:
    """List the files of solids of a folder, by name.

    Raises
    ------
    UsageError
        if there are none
    """
    found = sorted(one for one in folder.iterdir() if one.suffix.lower() in SOLIDS and one.is_file())
    if not found:
        remedy = f"name a folder with files that end in {', '.join(SOLIDS)}"
        raise UsageError("the folder has no solids", where=str(folder), remedy=remedy)
    return tuple(found)


SOLIDS = (".obj", ".ply", ".stl", ".msh")
"""Endings of files of solids."""

FORMATS: Mapping[str, Reader] = {
    "moma": open_moma,
    "csv": open_csv,
    "pnezd": open_pnezd,
    "penzd": open_penzd,
    "solids": _open_solids,
}
"""Readers by the name of their format."""


def open_survey(path: Path | str, format: str, options: ReadingOptions | None = None) -> SurveyStream:
    """Open a survey file, whose stones are then read one by one.

    Parameters
    ----------
    path : the file
    format : one of `FORMATS`
    options : values that the file may leave out

    Returns
    -------
    SurveyStream : the head, and the stones; a wrong stone comes as a Reject

    Raises
    ------
    SurveyError
        naming file and line, if the file as a whole or its head is wrong; also while stones are read, if the rest
        of the file is
    UsageError
        if there is no such format, or the options do not suit it

    Examples
    --------
    >>> stream = open_survey("data/samples/window/window.moma", "moma")
    >>> stream.head.name
    'window bay (synthetic)'
    >>> stone = next(stream.blocks)
    >>> stone.code, stone.vertices.shape, stone.sigma
    ('W01-01', (4, 3), 0.00173)
    """
    if format not in FORMATS:
        raise UsageError(f"unknown format {format!r}", remedy=f"known formats: {', '.join(FORMATS)}")
    return FORMATS[format](Path(path), options or ReadingOptions())


def read_survey(path: Path | str, format: str, options: ReadingOptions | None = None) -> Survey:
    """Read a survey file completely, and refuse it if any stone is wrong.

    Parameters
    ----------
    path, format, options : as for `open_survey`; a format of measured stones, not of solids

    Raises
    ------
    SurveyError
        of the first stone that is wrong; otherwise as `open_survey`
    UsageError
        as `open_survey`
    """
    return whole(open_survey(path, format, options), Path(path))
