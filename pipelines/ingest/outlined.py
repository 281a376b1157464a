"""Surveys that consist of outlines: over a point cloud, or alone at a stated scale."""

import csv
import re
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from ground.errors import UsageError
from mechanics.dynamics.progress import Listener, Progress, silent
from pipelines.ingest.reading_options import Source
from survey.clouds.outlines.outline import field_map
from survey.clouds.settings import CloudOptions, MaskOptions
from survey.clouds.wall import read_wall
from survey.conventions import FARTHEST, THINNEST
from survey.formats.options import ReadingOptions
from survey.formats.reading import open_survey
from survey.records.review import Doubtful
from survey.records.survey import Reject, SurveyStream

_MARK = b"outlines rejected by moma"
_SIZE = re.compile(r"(\d+(?:[.,]\d+)?)\s*[x×]\s*(\d+(?:[.,]\d+)?)")
_SIGMAS = (THINNEST, 0.2)  # bounds of the standard deviation of a drawn corner [m]


def open_source(
    source: Source, format: str, options: ReadingOptions | None, progress: Listener = silent
) -> SurveyStream:
    """Open a survey of any format.

    Parameters
    ----------
    source : its files
    format : its name; "cloud" with `CloudOptions`; "masks", which may be outlines, with `MaskOptions`
    options : defaults for what the files leave out
    progress : told of the points of a cloud that are read

    Raises
    ------
    UsageError, SurveyError
        if the files cannot be read
    """
    if format == "cloud":
        if not isinstance(options, CloudOptions):
            raise UsageError("a cloud without outlines", remedy="name them with --outlines")
        from survey.clouds.cloud import open_cloud  # kernels that other formats do without

        return open_cloud(
            source.files,
            options,
            lambda done, total: progress(Progress(f"read {source.path.name}", done, total)),
        )
    if format == "masks":
        from survey.clouds.masks import open_masks

        return open_masks(source.path, options if isinstance(options, MaskOptions) else MaskOptions())
    return open_survey(source.path, format, source.options(options))


def read_files(source: Source, options: ReadingOptions | None) -> tuple[Path, ...]:
    """Return the files from which the stones of a survey come."""
    return (*source.files, options.outlines) if isinstance(options, CloudOptions) else source.files


def outline_rejects_path(source: Path, options: ReadingOptions | None) -> Path:
    """Return the default file for rejected outlines: beside them, ``NAME.rejects.geojson``."""
    path = options.outlines if isinstance(options, CloudOptions) else source
    return path.with_name(f"{path.stem}.rejects.geojson")


def check_outline_rejects(target: Path) -> None:
    """Check that a file of rejected outlines replaces no other.

    Raises
    ------
    UsageError
        naming the file that would be lost
    """
    if target.is_dir() or (target.exists() and not _is_ours(target)):
        what = "exists and is not a file of rejected outlines, or was changed since"
        raise UsageError(what, where=str(target), remedy="move it away, or name another file with --rejects")


def _is_ours(target: Path) -> bool:
    with target.open("rb") as file:
        return _MARK in file.readline()


def outline_rejects(source: Path, options: ReadingOptions | None, rejects: Sequence[Reject]) -> bytes:
    """Write rejected outlines as GeoJSON, in the coordinates in which they were drawn."""
    from survey.clouds.outlines.rejected import rejected_outlines

    if isinstance(options, CloudOptions):
        path, layer, chosen = options.outlines, options.layer, options.chosen
        return rejected_outlines(path, layer, chosen, options.outline_sigma, options.smooth, rejects)
    masks = options if isinstance(options, MaskOptions) else MaskOptions()
    return rejected_outlines(source, masks.layer, masks.chosen, masks.outline_sigma, masks.smooth, rejects)


def write_review(path: Path, review: Sequence[Doubtful]) -> None:
    """Write the list of outlines that should be looked at as CSV.

    Raises
    ------
    UsageError
        if the file cannot be written
    """
    try:
        with path.open("w", encoding="utf-8", newline="") as file:
            rows = csv.writer(file, lineterminator="\n")
            rows.writerow(("code", "reason", "text", "where"))
            rows.writerows((doubt.code, doubt.reason, doubt.text, doubt.where) for doubt in review)
    except OSError as error:
        what = f"the review cannot be written: {error.strerror or error}"
        raise UsageError(what, where=str(path), remedy="name a file that can be written") from error


def cloud_options(
    base: ReadingOptions,
    outlines: Path,
    wall: str | None = None,
    layer: str | None = None,
    chosen: str | None = None,
    outline_sigma: float | None = None,
    margin: float | None = None,
    slab: float | None = None,
) -> CloudOptions:
    """Gather the settings of a cloud with outlines; None keeps the default.

    Parameters
    ----------
    base : options of all formats; its sigma is that of a single point, its unit that of the outlines
    outlines : file of outlines
    wall : file of a frame, or two points on the foot of a wall
    layer : of a file of outlines with several
    chosen : attributes by meaning, e.g. "code=Stein_Nr"
    outline_sigma, margin, slab : as in `CloudOptions`

    Raises
    ------
    UsageError, SurveyError
        if a value is out of its range, or the frame cannot be read
    """
    _check_lengths(
        ("--outline-sigma", outline_sigma, *_SIGMAS),
        ("--margin", margin, 0.0, 0.5),
        ("--slab", slab, 0.005, 5.0),
    )
    default = CloudOptions()
    return CloudOptions(
        **_shared(base) | {"unit": 1.0},  # lengths of clouds are metres
        outlines=outlines,
        wall=None if wall is None else read_wall(wall),
        layer=layer,
        chosen=field_map(chosen),
        outline_unit=base.unit,
        outline_sigma=outline_sigma or default.outline_sigma,
        margin=margin,
        slab=slab or default.slab,
    )


def mask_options(
    base: ReadingOptions,
    size: str | None = None,
    depth: float | None = None,
    wall: str | None = None,
    chosen: str | None = None,
    layer: str | None = None,
    outline_sigma: float | None = None,
) -> MaskOptions:
    """Gather the settings of masks or outlines without a cloud; None keeps the default.

    Parameters
    ----------
    base : options of all formats
    size : of the picture, or of the wall from the origin of outlines in metres [m], e.g. "1.0x1.2"
    depth : of all stones [m]
    wall : file of a frame, or two points on the foot of a wall
    chosen : attributes by meaning
    layer : of a file of outlines with several
    outline_sigma : as in `MaskOptions`

    Raises
    ------
    UsageError, SurveyError
        if a value cannot be read, or is out of its range
    """
    if depth is not None and not 0.0 < depth < 10.0:
        raise UsageError(f"is {depth:g} m", where="--depth", remedy="give it in metres, e.g. 0.2")
    _check_lengths(("--outline-sigma", outline_sigma, *_SIGMAS))
    if size is not None and base.unit is not None:
        raise UsageError("--unit beside --size", remedy="leave --unit out: --size states metres")
    default = MaskOptions()
    return MaskOptions(
        **_shared(base) | ({} if size is None else {"unit": 1.0}),
        size=None if size is None else size_of(size),
        depth=depth,
        wall=None if wall is None else read_wall(wall),
        layer=layer,
        chosen=field_map(chosen),
        outline_sigma=outline_sigma or default.outline_sigma,
    )


def _check_lengths(*lengths: tuple[str, float | None, float, float]) -> None:
    for name, value, least, most in lengths:
        if value is not None and not least <= value <= most:
            what, remedy = f"is {value:g} m", f"give it in metres, from {least:g} to {most:g}"
            raise UsageError(what, where=name, remedy=remedy)


def size_of(text: str) -> tuple[float, float]:
    """Read width and height [m], e.g. "1.0x1.2".

    Raises
    ------
    UsageError
        if it is written otherwise
    """
    match = _SIZE.fullmatch(text.strip().lower().removesuffix("m").strip())
    if match is not None:
        width, height = (float(group.replace(",", ".")) for group in match.groups())
        if 0.0 < width < FARTHEST and 0.0 < height < FARTHEST:
            return width, height
    remedy = "give width and height of the picture or wall in metres, e.g. 1.0x1.2"
    raise UsageError(f"is {text!r}", where="--size", remedy=remedy)


def _shared(base: ReadingOptions) -> dict[str, Any]:
    """Return the options of all formats."""
    return {field.name: getattr(base, field.name) for field in fields(ReadingOptions)}
