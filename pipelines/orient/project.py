"""Project files of `moma orient`: where marks, control points, cameras and photographs are, and what is estimated."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ground.errors import SceneError, UsageError
from ground.settings import Setting
from ground.toml.keys import Numbers, Texts, Vector, keys_of, read_table
from ground.toml.lines import key_lines, parse_toml, read_text
from ground.toml.schema import Key, TomlDocument, ValueKind, check_table, nearest, tables_of
from survey.conventions import PER_CENT
from survey.orientation.formats.colmap import read_colmap
from survey.orientation.formats.control import read_control, with_control
from survey.orientation.formats.dbat import read_dbat
from survey.orientation.formats.marks import network_of, read_marks
from survey.orientation.formats.metashape import read_metashape
from survey.orientation.formats.opencv import read_calibration
from survey.orientation.formats.other_programs import refuse_other_programs
from survey.orientation.formats.photomodeler import read_photomodeler
from survey.orientation.network import INTERIOR, Camera, Network, Photo, PlumbLine, ScaleBar
from survey.orientation.rotations import from_angles

WRITTEN = ("photomodeler", "colmap", "metashape", "dbat")
"""Formats in which a result can be written."""


@dataclass(frozen=True, kw_only=True)
class ProjectTable:
    """Keys at the top of a project file."""

    name: Annotated[str | None, Setting("Name of the project.")] = None
    marks: Annotated[str | None, Setting("File of marks: photograph, point, x, y, sigma.")] = None
    photomodeler: Annotated[
        str | None, Setting("Text export of PhotoModeler, instead of marks and cameras.")
    ] = None
    size: Annotated[
        Numbers | None,
        Setting(
            "Width and height of the photographs, with an export of PhotoModeler that does not state them.",
            "px",
        ),
    ] = None
    colmap: Annotated[
        str | None, Setting("Folder with a model of COLMAP, as text or binary, instead of marks and cameras.")
    ] = None
    metashape: Annotated[
        str | None, Setting("XML of cameras that Metashape exports, instead of cameras.")
    ] = None
    markers: Annotated[str | None, Setting("XML of markers that Metashape exports, with `metashape`.")] = None
    dbat: Annotated[
        str | None, Setting("Script of the Damped Bundle Adjustment Toolbox, instead of all others.")
    ] = None
    control: Annotated[str | None, Setting("File of control points: number, name, X, Y, Z, deviations.")] = (
        None
    )
    fixed_control: Annotated[
        bool, Setting("Control points keep their places, whatever their deviations.")
    ] = False
    check: Annotated[Texts, Setting("Control points that only check the result.")] = ()
    sigma: Annotated[
        float, Setting("Standard deviation of marks without one of their own.", "px", above=0)
    ] = 1.0
    datum: Annotated[
        str | None,
        Setting(
            "`start`: scale and vertical of the start values are right, as of a model that was placed before.",
            choices=("start",),
        ),
    ] = None
    blunders: Annotated[
        str,
        Setting(
            "Whether marks that the test finds wrong are left out.",
            choices=(
                "report",
                "remove",
            ),
        ),
    ] = "report"
    write: Annotated[
        Texts, Setting("Formats in which the result is written too: photomodeler, colmap, metashape, dbat.")
    ] = ()
    pictures: Annotated[
        str | None, Setting("Folder of the photographs themselves, on which results are drawn.")
    ] = None
    calibrate: Annotated[
        Texts, Setting("Parameters of cameras without a list of their own that are estimated.")
    ] = ()


@dataclass(frozen=True, kw_only=True)
class _CameraTable:
    """Table [[cameras]]."""

    name: Annotated[str, Setting("Name of the camera.")]
    unit: Annotated[
        str,
        Setting(
            "Unit of its image.",
            choices=(
                "mm",
                "px",
            ),
        ),
    ] = "mm"
    model: Annotated[
        str,
        Setting(
            "Model of its distortion.",
            choices=(
                "backward",
                "forward",
            ),
        ),
    ] = "backward"
    calibration: Annotated[
        str | None, Setting("Calibration of OpenCV in YAML or XML, instead of what follows.")
    ] = None
    size: Annotated[Numbers | None, Setting("Width and height of its photographs.", "px")] = None
    pixel: Annotated[float | None, Setting("Height of a pixel; 1 in the unit px.", "unit", above=0)] = None
    calibrate: Annotated[Texts | None, Setting("Parameters that are estimated.")] = None


CAMERA_KEYS = (
    *keys_of(_CameraTable),
    *(
        Key(
            name,
            ValueKind.NUMBER,
            f"Interior orientation, {name}.",
            "unit",
            None if name in ("c", "xp", "yp") else 0.0,
        )
        for name in INTERIOR
    ),
)
"""Keys of `[[cameras]]`."""


@dataclass(frozen=True, kw_only=True)
class PhotoTable:
    """Table [[photos]]."""

    name: Annotated[str, Setting("Name of the photograph, as in the marks.")]
    camera: Annotated[str | None, Setting("Its camera; not needed if there is one.")] = None
    station: Annotated[Vector | None, Setting("Place of the projection centre.", "m")] = None
    station_sigma: Annotated[
        Vector | None, Setting("Its standard deviations, which make it an observation.", "m", above=0)
    ] = None
    angles: Annotated[Vector | None, Setting("ω, φ, κ.", "°")] = None
    angles_sigma: Annotated[
        Vector | None, Setting("Their standard deviations, which make them observations.", "°", above=0)
    ] = None
    fixed: Annotated[bool, Setting("Station and angles are not estimated.")] = False


@dataclass(frozen=True, kw_only=True)
class ScaleBarTable:
    """Table [[scale_bars]]."""

    points: Annotated[Texts, Setting("Its two ends, as in the marks.")]
    length: Annotated[float, Setting("Measured distance between them.", "m", above=0)]
    sigma: Annotated[float, Setting("Standard deviation of the length.", "m", above=0)] = 5e-4


@dataclass(frozen=True, kw_only=True)
class PlumbLineTable:
    """Table [[plumb_lines]]."""

    points: Annotated[Texts, Setting("Points above each other, the lowest first, as in the marks.")]
    sigma: Annotated[
        float,
        Setting("Standard deviation of their level distance from a plumb line, in x and in y.", "m", above=0),
    ] = 2e-3


@dataclass(frozen=True)
class Project:
    """A project that was read.

    Attributes
    ----------
    name : of the project
    network : with its control points
    blunders : "report" or "remove"
    write : formats in which the result is written too
    pictures : file of each photograph by its name; empty: not given
    """

    name: str
    network: Network
    blunders: str
    write: tuple[str, ...] = ()
    pictures: Mapping[str, Path] = field(default_factory=dict)


def read_project(path: Path) -> Project:
    """Read a project file and the files that it names, relative to it.

    Raises
    ------
    SceneError
        at the key that is wrong
    SurveyError
        at the line of another file that is wrong
    """
    refuse_other_programs(path)
    text = read_text(path, SceneError)
    tables = parse_toml(text, str(path), SceneError, "see docs/howto/photographs.md")
    document = TomlDocument(str(path), key_lines(text))
    cameras, photos = tables_of(document, tables, "cameras"), tables_of(document, tables, "photos")
    bars, plumb_lines = (tables_of(document, tables, name) for name in ("scale_bars", "plumb_lines"))
    plain = {name: value for name, value in tables.items() if name not in _TABLES}
    values = read_table(document, (), plain, ProjectTable, "the project")
    for name in (*_SOURCES, "markers", "control"):
        if (file := getattr(values, name)) is not None:
            refuse_other_programs(path.parent / file)
    network = _network(document, values, cameras, photos, path.parent)
    if (control := values.control) is not None:
        rows = read_control(path.parent / control)
        network = with_control(network, rows, fixed=values.fixed_control, check=values.check)
    elif values.photomodeler is not None and network.control and not values.check:
        network = exported_control(network, values.fixed_control)
    elif values.check or values.fixed_control:
        key = "check" if values.check else "fixed_control"
        document.fail(f"{key} without control points", key, remedy="give control = FILE")
    network = replace(
        _with_lengths(document, network, bars, plumb_lines), start_datum=values.datum == "start"
    )
    network = calibrated(network, values.calibrate, document.where("calibrate"))
    for name in values.write:
        if name not in WRITTEN:
            document.fail(f"no format {name!r}", "write", remedy=nearest(name, WRITTEN))
    pictures = {} if values.pictures is None else _pictures(document, path.parent / values.pictures, network)
    return Project(values.name or path.stem, network, values.blunders, values.write, pictures)


_TABLES = ("cameras", "photos", "scale_bars", "plumb_lines")


def _with_lengths(
    document: TomlDocument,
    network: Network,
    bars: Sequence[tuple[tuple[str, ...], Mapping[str, Any]]],
    plumb_lines: Sequence[tuple[tuple[str, ...], Mapping[str, Any]]],
) -> Network:
    """Give a network its scale bars and plumb lines."""
    index = {name: k for k, name in enumerate(network.names)}

    def points(names: Texts, *path: str) -> tuple[int, ...]:
        """Return the numbers of points that are named."""
        for name in names:
            if name not in index:
                document.fail(f"no point {name!r} is marked", *path, remedy=nearest(name, tuple(index)))
        if len(set(names)) < len(names) or len(names) < 2 or (path[0] == "scale_bars" and len(names) > 2):
            count = "two different points" if path[0] == "scale_bars" else "two or more different points"
            document.fail(f"points are not {count}", *path, remedy='e.g. points = ["T01", "T02"]')
        return tuple(index[name] for name in names)

    made_bars, made_lines = list[ScaleBar](), list[PlumbLine]()
    for path, given in bars:
        bar = read_table(document, path, given, ScaleBarTable, "[[scale_bars]]")
        first, second = points(bar.points, *path)
        made_bars.append(ScaleBar((first, second), bar.length, bar.sigma, document.where(*path)))
    for path, given in plumb_lines:
        line = read_table(document, path, given, PlumbLineTable, "[[plumb_lines]]")
        made_lines.append(PlumbLine(points(line.points, *path), line.sigma, document.where(*path)))
    return replace(network, bars=tuple(made_bars), plumb_lines=tuple(made_lines))


def exported_control(network: Network, fixed: bool) -> Network:
    """Keep the control points of an export of PhotoModeler as fixed points, or leave them out with a remark.

    The export has their adjusted places, which are no observations unless they were fixed.
    """
    if fixed:
        return network
    remark = (
        f"{len(network.control)} control points of the export are left out, as it has their adjusted places: give "
        "their file, or fix them"
    )
    return replace(network, control=(), remarks=(*network.remarks, remark))


_ENDINGS = (".jpg", ".jpeg", ".png", ".tif", ".tiff")
_ASPECT = PER_CENT  # difference of width over height between a camera and its picture, relative


def _pictures(document: TomlDocument, folder: Path, network: Network) -> dict[str, Path]:
    """Return the file of each photograph: of its name, or of its name with the ending of a picture.

    Raises
    ------
    SceneError
        if there is none, or it has other proportions than the camera
    """
    from PIL import Image

    try:
        files = sorted(one for one in folder.iterdir() if one.suffix.lower() in _ENDINGS)
    except OSError:
        document.fail(
            f"no folder {folder}", "pictures", remedy="give the folder of the photographs, or leave it out"
        )
    by_name = {file.stem.lower(): file for file in files} | {file.name.lower(): file for file in files}
    out = dict[str, Path]()
    for f, photo in enumerate(network.photos):
        found = by_name.get(photo.name.lower()) or by_name.get(Path(photo.name).stem.lower())
        if found is None:
            document.fail(
                f"no picture of photograph {photo.name} in {folder}",
                "pictures",
                remedy=f"name it {photo.name}.jpg, or leave pictures out",
            )
        if (other := next((name for name, one in out.items() if one == found), None)) is not None:
            document.fail(
                f"{found} would be the picture of {other} and of {photo.name}",
                "pictures",
                remedy=f"give each photograph a picture of its own name, e.g. {photo.name}.jpg, or leave pictures out",
            )
        try:
            with Image.open(found) as picture:
                width, height = picture.size
        except OSError as error:
            document.fail(f"{found} cannot be read: {error}", "pictures", remedy="give JPEG, PNG or TIFF")
        size = network.camera_of(f).size
        if abs(width * size[1] / (height * size[0]) - 1.0) > _ASPECT:
            turned = abs(height * size[1] / (width * size[0]) - 1.0) <= _ASPECT
            document.fail(
                f"{found} has {width} × {height} pixels, its camera {size[0]} × {size[1]}",
                "pictures",
                remedy="turn it back as the camera took it: marks refer to that"
                if turned
                else "give the whole picture, of any resolution",
            )
        out[photo.name] = found
    return out


def calibrated(network: Network, names: tuple[str, ...], where: str) -> Network:
    """Let parameters of the cameras be estimated, those of cameras without a choice of their own.

    Raises
    ------
    UsageError
        if there is no such parameter
    """
    for name in names:
        if name not in INTERIOR:
            raise UsageError(
                f"no parameter {name!r} of a camera", where=where, remedy=nearest(name, INTERIOR)
            )
    if not names:
        return network
    return replace(
        network,
        cameras=tuple(camera if camera.free else replace(camera, free=names) for camera in network.cameras),
    )


_Tables = list[tuple[tuple[str, ...], dict[str, Any]]]
_SOURCES = ("marks", "photomodeler", "colmap", "metashape", "dbat")


def _network(
    document: TomlDocument,
    values: ProjectTable,
    cameras: _Tables,
    photos: _Tables,
    folder: Path,
) -> Network:
    given = [name for name in _SOURCES if getattr(values, name) is not None]
    if not given:
        document.fail("the project has no photographs", remedy=f"give one of {', '.join(_SOURCES)}")
    main = [name for name in given if name != "marks"]
    if len(main) > 1 or (main and main != ["metashape"] and "marks" in given):
        document.fail(f"{given[0]} and {given[1]}", given[1], remedy="give one of them")
    if main and (cameras or photos):
        document.fail(f"[[cameras]] or [[photos]] beside {main[0]}", "cameras", remedy="leave them out")
    if not main:
        if values.size is not None:
            document.fail("size beside marks", "size", remedy="write it into [[cameras]]")
        return _marked(document, values, cameras, photos, folder)
    if values.size is not None and main[0] != "photomodeler":
        document.fail(f"size with {main[0]}", "size", remedy="leave it out")
    source, sigma = folder / getattr(values, main[0]), values.sigma
    if main[0] == "photomodeler":
        return read_photomodeler(
            source, None if values.size is None else _size(document, values.size, "size")
        )
    if main[0] == "colmap":
        return read_colmap(source, sigma)
    if main[0] == "dbat":
        return read_dbat(source)
    markers = values.markers
    file = None if markers is None else folder / markers
    network = read_metashape(source, file, sigma)
    if values.marks is None:
        return network
    marks = folder / values.marks
    return network_of(str(marks), read_marks(marks), network.cameras, network.photos, sigma)


def _marked(
    document: TomlDocument,
    values: ProjectTable,
    cameras: _Tables,
    photos: _Tables,
    folder: Path,
) -> Network:
    """Make a network of a file of marks and the cameras and photographs of the project file."""
    if not cameras:
        document.fail("the project has no cameras", remedy="write [[cameras]] with name, size, pixel, c")
    made = tuple(_camera(document, place, table, folder) for place, table in cameras)
    names = [one.name for one in made]
    if len(set(names)) < len(names):
        document.fail("two cameras have one name", "cameras", remedy="give each a name of its own")
    assert values.marks is not None
    marks = folder / values.marks
    rows = read_marks(marks)
    known = tuple(_photo(document, place, table, names) for place, table in photos)
    if not known:
        if len(made) > 1:
            document.fail(
                f"{len(made)} cameras, but no [[photos]]",
                "cameras",
                remedy="write [[photos]] with name and camera",
            )
        known = tuple(Photo(name, 0, where=f"{marks}") for name in dict.fromkeys(row.photo for row in rows))
    return network_of(str(marks), rows, made, known, values.sigma)


def _camera(document: TomlDocument, path: tuple[str, ...], given: Mapping[str, Any], folder: Path) -> Camera:
    values: dict[str, Any] = check_table(document, path, given, CAMERA_KEYS, "[[cameras]]")
    free = values["calibrate"] or ()
    for name in free:
        if name not in INTERIOR:
            document.fail(
                f"no parameter {name!r} of a camera", *path, "calibrate", remedy=nearest(name, INTERIOR)
            )
    if values["calibration"] is not None:
        if also := sorted(set(given) - {"name", "calibration", "calibrate"}):
            document.fail(f"{also[0]} beside calibration", *path, also[0], remedy="leave it out")
        return replace(read_calibration(folder / values["calibration"], values["name"]), free=free)
    for key, what in (
        ("size", "width and height of its photographs in pixels"),
        ("c", "the camera constant"),
    ):
        if values[key] is None:
            document.fail(f"[[cameras]] has no {key!r}", *path, remedy=f"give {key}: {what}")
    width, height = _size(document, values["size"], *path, "size")
    pixel = values["pixel"]
    if pixel is None:
        if values["unit"] != "px":
            document.fail(
                "[[cameras]] has no 'pixel'", *path, remedy="give pixel: the height of a pixel in mm"
            )
        pixel = 1.0
    middle = {"xp": 0.5 * width * float(pixel), "yp": 0.5 * height * float(pixel)}
    inner = [values[name] if values[name] is not None else middle[name] for name in INTERIOR]
    return Camera(
        values["name"],
        np.array(inner, dtype=float),
        (width, height),
        float(pixel),
        values["unit"],
        values["model"] == "forward",
        free,
        document.where(*path),
    )


def _size(document: TomlDocument, size: Numbers, *path: str) -> tuple[int, int]:
    """Return width and height in pixels."""
    if len(size) != 2 or not all(float(one) == int(one) > 0 for one in size):
        document.fail("size is not a width and a height in pixels", *path, remedy="e.g. size = [6000, 4000]")
    return int(size[0]), int(size[1])


def _photo(
    document: TomlDocument, path: tuple[str, ...], given: Mapping[str, Any], cameras: list[str]
) -> Photo:
    values = read_table(document, path, given, PhotoTable, "[[photos]]")
    camera = values.camera
    if camera is None and len(cameras) > 1:
        document.fail("[[photos]] has no 'camera'", *path, remedy=f"give one of {', '.join(cameras)}")
    if camera is not None and camera not in cameras:
        document.fail(f"no camera {camera!r}", *path, "camera", remedy=nearest(camera, cameras))
    if values.fixed and (values.station is None or values.angles is None):
        document.fail("a fixed photograph without station and angles", *path, "fixed", remedy="give both")

    station, angles, sigma, angle_sigma = (
        None if value is None else np.array(value)
        for value in (values.station, values.angles, values.station_sigma, values.angles_sigma)
    )
    rotation = None if angles is None else from_angles(*np.radians(angles))
    for name, place, own in (("station", station, sigma), ("angles", angles, angle_sigma)):
        if own is not None and place is None:
            document.fail(f"{name}_sigma without {name}", *path, f"{name}_sigma", remedy=f"give {name}")
    return Photo(
        values.name,
        0 if camera is None else cameras.index(camera),
        rotation,
        station,
        None if sigma is None else station,
        sigma,
        None if angle_sigma is None else rotation,
        None if angle_sigma is None else np.radians(angle_sigma),
        values.fixed,
        document.where(*path),
    )
