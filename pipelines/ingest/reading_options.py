"""Reading options from what a user gives beside the names of survey files."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ground.errors import UsageError
from ground.tables.columns import length_unit
from ground.units import LENGTHS
from survey.formats.native.reader import with_header
from survey.formats.options import ReadingOptions
from survey.formats.reading import ENDINGS, format_of, solid_files
from survey.formats.tables.kinds import read_kinds
from survey.formats.tables.roles import read_roles

_ENDINGS: Mapping[str, tuple[str, ...]] = {
    **ENDINGS,
    "pnezd": (".txt", ".csv"),
    "penzd": (".txt", ".csv"),
    "cloud": (".las", ".laz", ".e57", ".ply", ".ptx", ".pcd", ".xyz", ".pts"),
    "masks": (".png", ".tif", ".tiff", ".json", ".csv", ".geojson", ".gpkg", ".shp", ".fgb", ".dxf"),
}
"""Endings of the files that are read of a folder, by format."""


def format_of_all(paths: Sequence[str | Path]) -> str:
    """Return the format of survey files, or of those in folders, by their endings and first lines.

    Raises
    ------
    UsageError : a file does not tell its format, or they differ
    """
    candidates: dict[str, Path] = {}
    for path in map(Path, paths):
        if not path.exists():
            raise UsageError("no such file", where=str(path), remedy="name a survey file")
        if path.is_dir():
            endings = {end for ends in ENDINGS.values() for end in ends} - {".json", ".xml"}
            inside = {
                format_of(path_inside): path_inside
                for path_inside in sorted(path.iterdir())
                if path_inside.suffix.lower() in endings and path_inside.is_file()
            }
            candidates.update(inside or {"moma": path})
        else:
            candidates.setdefault(format_of(path), path)
    if len(candidates) > 1:
        names = " and ".join(f"{path.name} ({name})" for name, path in sorted(candidates.items()))
        raise UsageError(
            f"files of different formats: {names}", remedy="ingest them one after the other, or give --format"
        )
    return next(iter(candidates), "moma")


@dataclass(frozen=True)
class Source:
    """One survey: a file, or several files of solids or of a point cloud.

    Attributes
    ----------
    path : the file, or the folder of all files
    files : the files
    """

    path: Path
    files: tuple[Path, ...]

    def options(self, options: ReadingOptions | None) -> ReadingOptions:
        """Return the options with which the survey is read."""
        several = len(self.files) > 1 or self.path.is_dir()
        return replace(options or ReadingOptions(), files=self.files if several else ())


def survey_sources(paths: Sequence[str | Path], format: str) -> tuple[Source, ...]:
    """Group files into surveys: all files of solids, or of a cloud, are one; of other formats each is one.

    Parameters
    ----------
    paths : files, or folders of files
    format : name of their format

    Raises
    ------
    UsageError : there is no such file, one is named twice, or a folder has none
    """
    files: list[Path] = []
    for path in map(Path, paths):
        files += _files_in(path, format) if path.is_dir() else [path]
    if not files:
        raise UsageError("no survey file", remedy="name at least one")
    seen: set[Path] = set()
    for file in files:
        if not file.is_file():
            raise UsageError("no such file", where=str(file), remedy="name a survey file")
        if file.resolve() in seen:
            raise UsageError("is given twice", where=str(file), remedy="name each survey file once")
        seen.add(file.resolve())
    if format not in ("solids", "cloud"):
        return tuple(Source(file, (file,)) for file in files)
    if len(paths) == 1 or len({file.parent for file in files}) > 1:
        return (Source(Path(paths[0]), tuple(files)),)
    return (Source(files[0].parent, tuple(files)),)


def _files_in(folder: Path, format: str) -> Sequence[Path]:
    """List the survey files of a folder by name, files of rejects left out."""
    if format == "solids":
        return solid_files(folder)
    endings = _ENDINGS.get(format, ())
    paths = sorted(
        entry
        for entry in folder.iterdir()
        if entry.suffix.lower() in endings and entry.is_file() and not entry.stem.endswith(".rejects")
    )
    if not paths:
        remedy = f"name a folder with files that end in {' or '.join(endings)}, or give --format"
        raise UsageError(f"the folder has no files of format {format}", where=str(folder), remedy=remedy)
    return paths


def reading_options(
    header: Path | None = None,
    codes: str | None = None,
    kind: str | None = None,
    sigma: float | None = None,
    unit: str | None = None,
    columns: str | None = None,
    sheet: str | None = None,
    kinds: str | None = None,
    roles: str | None = None,
) -> ReadingOptions:
    """Gather the options of a reader; None keeps the default.

    Parameters
    ----------
    header : header file, for formats without a header
    codes : template of the codes of a point list
    kind : of stones without one
    sigma : of a coordinate, where the file has none; it takes precedence over the header file [m]
    unit : one of `LENGTHS`, in which coordinates are given
    columns : names of columns of a table by what they are, e.g. ``block=Stein,x=Rechts``
    sheet : of a workbook
    kinds : abbreviations of kinds, e.g. ``SPR=springer``, or a file with them
    roles : words for roles of points, e.g. ``Fl=point,HP=control``

    Raises
    ------
    UsageError : the sigma is not positive, there is no such header file or unit
    SurveyError : naming the line of the header file that is wrong
    """
    options = ReadingOptions(codes=codes, columns=columns, sheet=sheet)
    if kinds is not None:
        options = replace(options, kinds=read_kinds(kinds))
    if roles is not None:
        options = replace(options, roles=read_roles(roles))
    if kind is not None:
        options = replace(options, kind=kind.lower())
    if header is not None:
        if not header.is_file():
            raise UsageError("no such file", where=str(header), remedy="name a header file with --header")
        options = _with_kinds(with_header(options, header))
    if sigma is not None:
        if not 0.0 < sigma < 1.0:
            raise UsageError(f"sigma is {sigma:g} m", where="--sigma", remedy="give it in metres, e.g. 0.003")
        options = replace(options, sigma=sigma)
    if unit is not None:
        if (unit_name := length_unit(unit)) is None:
            what, remedy = f"unknown unit {unit!r}", f"units: {', '.join(LENGTHS)}"
            raise UsageError(what, where="--unit", remedy=remedy)
        options = replace(options, unit=LENGTHS[unit_name])
    return options


def _with_kinds(options: ReadingOptions) -> ReadingOptions:
    """Return options whose header has kinds in place of the abbreviations that the user has told."""
    head, kinds = options.head, options.kinds
    if head is None or not kinds:
        return options
    rules = tuple(replace(rule, kind=kinds.get(rule.kind or "", rule.kind)) for rule in head.depth_rules)
    canons = tuple(replace(canon, kind=kinds.get(canon.kind, canon.kind)) for canon in head.canons)
    return replace(options, head=replace(head, depth_rules=rules, canons=canons))


def solid_options(
    options: ReadingOptions,
    up: str | None = None,
    repair: float | None = None,
    snap: float | None = None,
    planes: float | None = None,
) -> ReadingOptions:
    """Add the options of files of solids to those of any reader; None keeps the default.

    Parameters
    ----------
    up : axis that points upwards, "y" or "z"
    repair : distance within which faults of solids are repaired [m]; 0: none is
    snap : tolerance within which faces of neighbouring solids are brought into one plane [m]
    planes : distance within which the facets of a scanned solid are one plane face [m]

    Raises
    ------
    UsageError : a distance is negative, or too large for a stone
    """
    options = replace(
        options, up=up, repair=_distance("--repair", repair, 1.0, "0.001; 0: nothing is repaired")
    )
    if (snap := _distance("--snap", snap, 1.0, "0.002; 0: none")) is not None:
        options = replace(options, snap=snap)
    if (planes := _distance("--planes", planes, 0.1, "0.005; 0 keeps every facet")) is not None:
        options = replace(options, planes=planes)
    return options


def _distance(option: str, value: float | None, below: float, example: str) -> float | None:
    """Return a distance that is from 0 to below a bound [m]."""
    if value is not None and not 0.0 <= value < below:
        remedy = f"give it in metres, e.g. {example}"
        raise UsageError(f"the tolerance is {value:g} m", where=option, remedy=remedy)
    return value
