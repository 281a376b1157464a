"""What a user says of survey files beside their names, as the readers want it."""

from dataclasses import replace
from pathlib import Path

from moma.errors import UsageError
from survey.formats.options import ReadingOptions
from survey.formats.reading import with_header

__all__ = ["check_survey_file", "reading_options"]


def check_survey_file(path: Path) -> None:
    """Refuse what is no file, before anything is read."""
    if not path.is_file():
        what = "is a folder" if path.is_dir() else "no such file"
        raise UsageError(what, where=str(path), remedy="name a survey file")


def reading_options(
    header: Path | None = None, codes: str | None = None, kind: str | None = None, sigma: float | None = None
) -> ReadingOptions:
    """Gather the options of a reader; what is None keeps its default.

    Parameters
    ----------
    header : file with a head, for formats that have none
    codes : template of the codes of a point list
    kind : of stones that do not say it
    sigma : of a coordinate, where the file does not say it; it holds before that of the header file [m]

    Raises
    ------
    UsageError : the sigma is not positive, or there is no such header file
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
    return options
