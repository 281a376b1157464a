"""Common entry to the readers of all survey formats."""

from collections.abc import Callable, Mapping
from pathlib import Path

from ground.errors import UsageError
from ground.tables.numbers import unreadable
from survey.formats.native.reader import open_moma
from survey.formats.options import ReadingOptions, whole
from survey.formats.points.geojson import open_geojson
from survey.formats.points.gsi import open_gsi
from survey.formats.points.survey_xml import open_jobxml, open_landxml
from survey.formats.tables.reader import is_table, open_csv, open_penzd, open_pnezd
from survey.records.survey import Survey, SurveyStream

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


ENDINGS: Mapping[str, tuple[str, ...]] = {
    "moma": (".moma",),
    "csv": (".csv", ".tsv", ".xlsx", ".xls", ".xlsb", ".ods", ".wkt"),
    "gsi": (".gsi",),
    "jobxml": (".jxl", ".jobxml"),
    "landxml": (".landxml", ".xml"),
    "geojson": (".geojson", ".json"),
    "solids": (".obj", ".ply", ".stl", ".msh"),
}
"""Endings of files by their format; ``.xml`` may be JobXML too, and ``.txt`` any list."""

_LISTS = (
    "give --format pnezd (northing first), penzd (easting first), or csv for a table with names of columns"
)
_DRAWN = "export closed solids as OBJ or STL, or outlines with z as GeoJSON"
_CLOUD = "give it with --cloud, and outlines of stones with --outlines"
_OUTLINED = "give outlines in the plane of a wall with --outlines and --depth, or with --cloud"
WAYS_OUT: Mapping[str, str] = {
    **dict.fromkeys((".txt", ".asc", ".dat", ".pnt", ".pts", ".xyz", ".tab", ".prn", ".coo"), _LISTS),
    **dict.fromkeys((".dwg", ".dgn", ".3dm", ".skp", ".blend", ".ifc", ".step", ".stp", ".igs"), _DRAWN),
    **dict.fromkeys((".fbx", ".glb", ".gltf", ".dae", ".3ds", ".off", ".wrl", ".vtk", ".vtu"), _DRAWN),
    **dict.fromkeys((".dxf", ".gpkg", ".shp", ".kml", ".gml", ".fgb"), _OUTLINED),
    **dict.fromkeys((".las", ".laz", ".e57", ".ptx", ".pcd"), _CLOUD),
    **dict.fromkeys((".raw", ".fld", ".idx", ".job", ".sdr", ".are", ".cor", ".m5", ".rw5"),
                    "export the coordinates with their codes as a point list (CSV), GSI, LandXML or JobXML"),
    **dict.fromkeys((".pdf", ".docx", ".doc", ".numbers"), "export the table itself as CSV or XLSX"),
}  # fmt: skip
"""Ways out for files that are not read, or not without a format, by ending."""

_SOLIDS_BY_CONTENTS = {
    ".json": (b'"compas.', b'"compas_'),
    ".dat": (b"! File BODIES", b"$bdyty"),
}
"""Words at the start of files of solids whose ending others have too: kinds of COMPAS, BODIES.DAT of LMGC90."""

SOLIDS = ENDINGS["solids"]
"""Endings of files of solids; `.json` of COMPAS and `BODIES.DAT` of LMGC90 are solids by their contents."""


def format_of(path: Path) -> str:
    """Return the format of a file by its first line and its ending.

    Raises
    ------
    UsageError
        if they do not say, with the way out
    """
    try:
        with path.open("rb") as handle:
            start = handle.read(4096)
    except OSError as error:
        raise unreadable(path, error, "give an existing survey file") from error
    ending = path.suffix.lower()
    if start.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"moma-survey"):
        return "moma"
    if ending == ".xml" and b"<JOBFile" in start:
        return "jobxml"
    if any(word in start for word in _SOLIDS_BY_CONTENTS.get(ending, ())):
        return "solids"
    for format, endings in ENDINGS.items():
        if ending in endings:
            return format
    if WAYS_OUT.get(ending) == _LISTS and is_table(path):
        return "csv"
    remedy = WAYS_OUT.get(ending, f"give --format, one of {', '.join(FORMATS)}")
    raise UsageError(f"the ending {ending!r} does not tell the format", where=str(path), remedy=remedy)


FORMATS: Mapping[str, Reader] = {
    "moma": open_moma,
    "csv": open_csv,
    "pnezd": open_pnezd,
    "penzd": open_penzd,
    "gsi": open_gsi,
    "jobxml": open_jobxml,
    "landxml": open_landxml,
    "geojson": open_geojson,
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
