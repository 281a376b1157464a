"""Models of COLMAP: cameras.txt, images.txt and points3D.txt in one folder, or the same in binary files (.bin).

    cameras.txt    CAMERA_ID MODEL WIDTH HEIGHT PARAMS…
    images.txt     IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then a line of X Y POINT3D_ID for each mark
    points3D.txt   POINT3D_ID X Y Z R G B ERROR, then IMAGE_ID POINT2D_IDX for each mark

A point X of the world has the camera coordinates R X + t, x to the right, y down, z forward. Distortion is forward, of
coordinates over the depth. Marks without a point are left out; marks have no precision.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ground.errors import SurveyError
from ground.tables.numbers import parse_number, shown
from ground.tables.text_lines import TextLines
from survey.arrays import Array
from survey.orientation.formats.colmap_binary import MODELS, binary_cameras, binary_images, binary_points
from survey.orientation.formats.marks import marked_well, marks_of_points, numbered
from survey.orientation.formats.opencv import interior
from survey.orientation.network import Camera, Network, Photo

_MODELS = ("SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "FULL_OPENCV")
"""Models whose distortion is that of Brown."""
_LONGEST = (
    1 << 26
)  # bytes of a line, which holds all marks of a photograph or of a point: a million of 60 bytes
_FLIP = np.diag([1.0, -1.0, -1.0])  # from y up and z backwards to y down and z forward


@dataclass(frozen=True)
class _Image:
    number: int
    photo: Photo
    marks: list[tuple[int, Array, int]]  # number of the point, place, line


def read_colmap(folder: Path, sigma: float = 1.0) -> Network:
    """Read a model.

    Parameters
    ----------
    folder : with the three files, as text or binary
    sigma : standard deviation of marks [px]

    Raises
    ------
    SurveyError
        naming file and line
    """
    ending = "txt" if (folder / "images.txt").exists() or not (folder / "images.bin").exists() else "bin"
    source = folder / f"images.{ending}"
    if ending == "txt":
        cameras = _cameras(folder / "cameras.txt")
        images = _images(source, {number: k for k, number in enumerate(cameras)})
        places = _points(folder / "points3D.txt")
    else:
        cameras = {
            number: _camera(number, model, size, values, where)
            for number, model, size, values, where in binary_cameras(folder / "cameras.bin")
        }
        images = _of_binary(source, {number: k for k, number in enumerate(cameras)})
        places = binary_points(folder / "points3D.bin")
    index = {number: k for k, number in enumerate(places)}
    photo, point, image, lines = list[int](), list[int](), list[Array](), list[int]()
    for k, one in enumerate(images):
        for number, place, line in one.marks:
            if number not in index:
                raise SurveyError(
                    f"point {number} is not in points3D.{ending}",
                    where=f"{source}:{line}" if line else str(source),
                    remedy="export the model again",
                )
            photo.append(k)
            point.append(index[number])
            image.append(place)
            lines.append(line)
    return marked_well(
        Network(
            str(source),
            tuple(cameras.values()),
            tuple(image.photo for image in images),
            tuple(map(str, places)),
            np.array(list(places.values())).reshape(-1, 3),
            (),
            np.array(photo, dtype=np.int64),
            np.array(point, dtype=np.int64),
            np.array(image).reshape(-1, 2),
            np.full((len(photo), 2), sigma),
            np.array(lines, dtype=np.int64),
        )
    )


def _number(text: str, what: str, where: str) -> int:
    if not (text.isascii() and text.lstrip("-").isdigit()):
        raise SurveyError(
            f"{what} is {shown(text)}, not a whole number", where=where, remedy="export the model again"
        )
    return int(text)


def _cameras(path: Path) -> dict[int, Camera]:
    lines, out = TextLines(path), dict[int, Camera]()
    for line, text in lines.rows():
        where, words = f"{lines.path}:{line}", text.split()
        model = words[1] if len(words) > 1 else ""
        if len(words) < 4:
            raise _unknown(model, where)
        number = _number(words[0], "the camera", where)
        size = _number(words[2], "the width", where), _number(words[3], "the height", where)
        values = [parse_number(word, "a parameter", where) for word in words[4:]]
        out[number] = _camera(number, model, size, values, where)
    return out


def _unknown(model: str, where: str) -> SurveyError:
    what, remedy = f"camera model {shown(model)} cannot be read", f"models that can: {', '.join(_MODELS)}"
    return SurveyError(what, where=where, remedy=remedy)


def _camera(
    number: int, model: str, size: tuple[int, int], parameters: Sequence[float], where: str
) -> Camera:
    if model not in _MODELS:
        raise _unknown(model, where)
    names = MODELS[model]
    if len(parameters) != len(names):
        raise SurveyError(
            f"{len(parameters)} parameters of {model}", where=where, remedy=f"it has {', '.join(names)}"
        )
    values = dict(zip(names, parameters, strict=True))
    for name in ("k4", "k5", "k6"):
        if values.get(name):
            raise SurveyError(
                f"{name} = {values[name]:g}: rational distortion cannot be read",
                where=where,
                remedy="estimate the model OPENCV",
            )
    return Camera(f"camera{number}", interior(values), size, 1.0, "px", True, where=where)


def _images(path: Path, cameras: dict[int, int]) -> list[_Image]:
    lines = TextLines(path, longest=_LONGEST)
    # the line of marks may be empty, so that empty lines count
    rows = [(line, text) for line, text in lines if not text.lstrip().startswith("#")]
    while rows and not rows[-1][1].strip() and len(rows) % 2:
        rows.pop()
    out: list[_Image] = []
    for (line, head), (under, marks) in zip(
        rows[::2], [*rows[1::2], *([(lines.end, "")] * (len(rows) % 2))], strict=True
    ):
        where, words = f"{lines.path}:{line}", head.split(maxsplit=9)
        if len(words) != 10:
            raise SurveyError(
                f"an image of {len(words)} values",
                where=where,
                remedy="write: IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME",
            )
        number, camera = _number(words[0], "the image", where), _number(words[8], "the camera", where)
        if camera not in cameras:
            raise SurveyError(
                f"camera {camera} is not in cameras.txt", where=where, remedy="export the model again"
            )
        pose = np.array([parse_number(word, "the pose", where) for word in words[1:8]])
        photo = _photo(words[9].strip(), cameras[camera], pose, where)
        values = marks.split()
        if len(values) % 3:
            raise SurveyError(
                f"{len(values)} values of marks",
                where=f"{lines.path}:{under}",
                remedy="write X Y POINT3D_ID for each",
            )
        found = list[tuple[int, Array, int]]()
        for k in range(0, len(values), 3):
            here = f"{lines.path}:{under}"
            point = _number(values[k + 2], "the point", here)
            if point >= 0:
                place = np.array([parse_number(word, "a mark", here) for word in values[k : k + 2]])
                found.append((point, place, under))
        out.append(_Image(number, photo, found))
    if not out:
        raise SurveyError("the file has no images", where=lines.path, remedy="export the model again")
    return out


def _photo(name: str, camera: int, pose: Array, where: str) -> Photo:
    turn, t = _rotation(pose[:4], where), pose[4:]
    return Photo(name, camera, turn.T @ _FLIP, -turn.T @ t, where=where)


def _of_binary(path: Path, cameras: dict[int, int]) -> list[_Image]:
    out = list[_Image]()
    for image in binary_images(path):
        where = f"{path}, image {image.number}"
        if image.camera not in cameras:
            raise SurveyError(
                f"camera {image.camera} is not in cameras.bin", where=where, remedy="export the model again"
            )
        marks = [(int(point), place, 0) for point, place in zip(image.points, image.places, strict=True)]
        out.append(_Image(image.number, _photo(image.name, cameras[image.camera], image.pose, where), marks))
    if not out:
        raise SurveyError("the file has no images", where=str(path), remedy="export the model again")
    return out


def _rotation(q: Array, where: str) -> Array:
    size = float(np.linalg.norm(q))
    if not abs(size - 1.0) < 1e-3:
        raise SurveyError(f"a quaternion of length {size:g}", where=where, remedy="export the model again")
    w, x, y, z = q / size
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _quaternion(rotation: Array) -> list[float]:
    """Return w, x, y, z of a rotation: the eigenvector of the largest eigenvalue of its symmetric form."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    form = np.array(
        [
            [a + e + i, h - f, c - g, d - b],
            [h - f, a - e - i, b + d, c + g],
            [c - g, b + d, e - a - i, f + h],
            [d - b, c + g, f + h, i - a - e],
        ]
    )
    q = np.linalg.eigh(form)[1][:, -1]
    out: list[float] = (q if q[0] >= 0.0 else -q).tolist()
    return out


def _points(path: Path) -> dict[int, Array]:
    lines, out = TextLines(path, longest=_LONGEST), dict[int, Array]()
    for line, text in lines.rows():
        where, words = f"{lines.path}:{line}", text.split()
        if len(words) < 4:
            raise SurveyError(
                f"a point of {len(words)} values", where=where, remedy="write: POINT3D_ID X Y Z R G B ERROR …"
            )
        out[_number(words[0], "the point", where)] = np.array(
            [parse_number(word, "a coordinate", where) for word in words[1:4]]
        )
    return out


def write_colmap(network: Network, folder: Path) -> None:
    """Write a model with all digits; cameras must have forward distortion.

    Points are numbers in this format. Where one has another name, all are numbered, and points-names.txt has number and
    name of each.

    Raises
    ------
    SurveyError
        if the format has no place for something
    """
    cameras = [_camera_line(k, camera, folder) for k, camera in enumerate(network.cameras, start=1)]
    for one in network.photos:
        if one.rotation is None or one.station is None:
            raise SurveyError(
                f"photograph {one.name} is not oriented", where=str(folder), remedy="orient it first"
            )
    folder.mkdir(parents=True, exist_ok=True)
    names = numbered(network, folder / "points-names.txt")
    images, place_of = list[str](), np.zeros(len(network.photo), dtype=int)
    for k, photo in enumerate(network.photos):
        assert photo.rotation is not None
        assert photo.station is not None
        turn = (photo.rotation @ _FLIP).T
        pose = [*_quaternion(turn), *(-turn @ photo.station).tolist()]
        mine = np.flatnonzero(network.photo == k)
        place_of[mine] = np.arange(len(mine))
        images.append(" ".join([str(k + 1), *map(repr, pose), str(photo.camera + 1), photo.name]))
        marks = [
            f"{x!r} {y!r} {names[i]}"
            for (x, y), i in zip(network.image[mine].tolist(), network.point[mine], strict=True)
        ]
        images.append(" ".join(marks))
    points, of_point = [], marks_of_points(network)
    for i in np.flatnonzero(np.isfinite(network.start).all(axis=1)):
        track = [f"{network.photo[k] + 1} {place_of[k]}" for k in of_point[i]]
        points.append(" ".join([names[i], *map(repr, network.start[i].tolist()), "0 0 0 0", *track]))
    for name, lines in (("cameras", cameras), ("images", images), ("points3D", points)):
        _write(folder / f"{name}.txt", lines)


def _camera_line(number: int, camera: Camera, folder: Path) -> str:
    if not camera.forward or camera.inner[4]:
        raise SurveyError(
            f"camera {camera.name} has {camera.model} distortion and skew {camera.inner[4]:g}",
            where=str(folder),
            remedy='COLMAP holds forward distortion without skew: calibrate with model = "forward"',
        )
    c, xp, yp, a, _, k1, k2, k3, p1, p2 = camera.inner.tolist()
    f = c / camera.pixel
    values = [f * (1.0 + a), f, xp / camera.pixel, yp / camera.pixel, k1 * c**2, k2 * c**4, -p2 * c, p1 * c]
    name = "OPENCV"
    if k3:
        name, values = "FULL_OPENCV", [*values, k3 * c**6, 0.0, 0.0, 0.0]
    return " ".join([str(number), name, *map(str, camera.size), *map(repr, values)])


def _write(path: Path, lines: Sequence[str]) -> None:
    path.write_text("\n".join([*lines, ""]), encoding="utf-8", newline="\n")
