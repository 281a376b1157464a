"""Reading options from what a user gives beside the names of survey files."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from moma.errors import UsageError
from survey.formats.options import ReadingOptions
from survey.formats.reading import with_header

__all__ = ["UNITS", "check_survey_file", "reading_options"]

UNITS: Mapping[str, float] = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "ft": 0.3048, "in": 0.0254}
"""Units in which solids may be given, by their length [m]."""


def check_survey_file(path: Path) -> None:
    """Refuse a path that is not a file, before anything is read."""
    if not path.is_file():
        what = "is a folder" if path.is_dir() else "no such file"
        raise UsageError(what, where=str(path), remedy="name a survey file")


def reading_options(
    header: Path | None = None,
    codes: str | None = None,
    kind: str | None = None,
    sigma: float | None = None,
    unit: str | None = None,
    snap: float | None = None,
) -> ReadingOptions:
    """Gather the options of a reader; None keeps the default.

    Parameters
    ----------
    header : header file, for formats without a header
    codes : template of the codes of a point list
    kind : of stones without one
    sigma : of a coordinate, where the file has none; it takes precedence over the header file [m]
    unit : one of `UNITS`, in which solids are given
    snap : tolerance within which faces of neighbouring solids are brought into one plane [m]

    Raises
    ------
    UsageError : the sigma is not positive, there is no such header file or unit, or the tolerance is negative
    SurveyError : naming the line of the header file that is wrong
    """
    options = ReadingOptions(codes=codes)
    if kind is not None:
        options = replace(options, kind=kind)
    if header is not None:
        if not header.is_file():
            raise UsageError("no such file", where=str(header), remedy="name a header file with --header")
        options = with_header(options, header)
    if sigma is not None:
        if not 0.0 < sigma < 1.0:
            raise UsageError(f"sigma is {sigma:g} m", where="--sigma", remedy="give it in metres, e.g. 0.003")
        options = replace(options, sigma=sigma)
    if unit is not None:
        if unit not in UNITS:
            what, remedy = f"unknown unit {unit!r}", f"units: {', '.join(UNITS)}"
            raise UsageError(what, where="--unit", remedy=remedy)
        options = replace(options, unit=UNITS[unit])
    if snap is not None:
        if not 0.0 <= snap < 1.0:
            what, remedy = f"the tolerance is {snap:g} m", "give it in metres, e.g. 0.002; 0: none"
            raise UsageError(what, where="--snap", remedy=remedy)
        options = replace(options, snap=snap)
    return options
