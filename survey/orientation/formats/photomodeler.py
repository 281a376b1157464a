"""PhotoModeler's text export of a project: camera, photographs, points and marks.

Lines, all of numbers separated by blanks, after the title in the first:

    tolerance, iterations, and in most exports width and height of the photographs [px]
    standard deviations by default: image point, control, points, stations (3), angles (3)
    c x_p y_p width height K₁ K₂ K₃ P₁ P₂ [mm], and their standard deviations in the next line
    of each photograph, counted from 0, with that number first: its file; X Y Z κ φ ω [°]; their standard deviations;
        covariances or an empty line; its camera as above; the standard deviations of that
    an empty line; control points, an empty line; points: number, X Y Z, standard deviations of these; an empty line
    marks: photograph, point, x, y [px], their standard deviations; an empty line; features, which are not read

The standard deviations of orientations and points are results, not observations. Points found by matching ("smart
points") begin their own numbers, and their marks have standard deviations of zero; they get numbers above all others.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path, PurePosixPath

import numpy as np

from ground.errors import SurveyError
from ground.tables.numbers import parse_number, shown
from ground.tables.text_lines import TextLines
from survey.arrays import Array
from survey.orientation.formats.marks import numbered
from survey.orientation.network import Camera, Control, Network, Photo
from survey.orientation.rotations import angles, from_angles

_COARSE = 1.5e-3  # half of the last digit of a camera repeated for a photograph, with a margin [mm]


class _Lines:
    """The lines of an export, one after another."""

    def __init__(self, path: Path) -> None:
        self.text = TextLines(path)
        self._lines = [line for _, line in self.text]
        self.number = 0

    def line(self, what: str) -> str:
        """Return the next line."""
        if self.number >= len(self._lines):
            raise self.text.fail(self.number, f"the file ends before {what}", "export the project again")
        self.number += 1
        return self._lines[self.number - 1]

    def numbers(self, what: str, counts: Sequence[int]) -> Array:
        """Return the numbers of the next line."""
        return self.parse(self.line(what), what, counts)

    def parse(self, line: str, what: str, counts: Sequence[int]) -> Array:
        """Return the numbers of a line."""
        words = line.split()
        if len(words) not in counts:
            expected = " or ".join(map(str, counts))
            raise self.fail(f"{what} has {len(words)} numbers", f"{expected} are expected")
        return np.array([parse_number(word, what, self.where) for word in words])

    def block(self, what: str, counts: Sequence[int]) -> Iterator[tuple[int, Array]]:
        """Yield the rows up to the next empty line, or to the end."""
        while self.number < len(self._lines):
            self.number += 1
            line = self._lines[self.number - 1]
            if not line.strip():
                return
            yield self.number, self.parse(line, what, counts)

    @property
    def where(self) -> str:
        """Place of the current line."""
        return f"{self.text.path}:{self.number}"

    def fail(self, what: str, remedy: str) -> SurveyError:
        """Make an error at the current line."""
        return self.text.fail(self.number, what, remedy)

    def photo(self) -> tuple[str, str] | None:
        """Return number and file of the next photograph; None at the empty line that ends them."""
        line = self.line("the end of the photographs").strip()
        if not line:
            return None
        number, _, file = line.partition(" ")
        if not number.isdigit():
            raise self.fail(
                f"photograph {shown(number)} is not a number", "a photograph has its number first"
            )
        return number, file.strip() or number


def read_photomodeler(path: Path, size: tuple[int, int] | None = None) -> Network:
    """Read an export.

    Parameters
    ----------
    size : width and height of the photographs [px], where the export does not state them

    Raises
    ------
    SurveyError
        naming file and line, if it is not such an export
    """
    lines = _Lines(path)
    lines.line("the title")
    settings = lines.numbers("the line of tolerance, iterations, width and height", (2, 4))
    if len(settings) == 4:
        stated = (int(settings[2]), int(settings[3]))
        if size is not None and size != stated:
            raise lines.fail(
                f"photographs of {stated[0]} × {stated[1]} pixels, but {size[0]} × {size[1]} are given",
                "leave the size out",
            )
    elif size is not None:
        settings = np.array([*settings, *size], dtype=float)
    else:
        raise lines.fail(
            "the line of tolerance, iterations, width and height has 2 numbers",
            "give the size of the photographs: size = [6000, 4000] in the project, or --size 6000x4000",
        )
    if not (settings[2:] >= 1.0).all():
        width, height = settings[2:].astype(int)
        raise lines.fail(f"the photographs have {width} × {height} pixels", "line 2 gives their size")
    default = lines.numbers("the line of standard deviations", (9,))
    common = lines.numbers("the camera", (10,))
    whole = _camera("camera1", common, settings[2:], lines.where)
    lines.numbers("the camera's standard deviations", (10,))
    cameras, photos, numbers = [whole], list[Photo](), dict[int, int]()
    while (header := lines.photo()) is not None:
        number, file = header
        where = lines.where
        orientation = lines.numbers(f"photograph {number}", (7,))[1:]
        lines.numbers(f"standard deviations of photograph {number}", (7,))
        lines.line(f"covariances of photograph {number}")
        parameters = lines.numbers(f"camera of photograph {number}", (11,))[1:]
        camera = _own_camera(cameras, parameters, common, settings[2:], lines.where)
        lines.numbers(f"standard deviations of the camera of photograph {number}", (11,))
        numbers[int(number)] = len(photos)
        name = PurePosixPath(file.replace("\\", "/")).name
        if name in {photo.name for photo in photos}:
            name = f"{number} {name}"
        is_oriented = bool(orientation.any())
        kappa, phi, omega = np.radians(orientation[3:])
        photos.append(
            Photo(
                name,
                camera,
                from_angles(omega, phi, kappa) if is_oriented else None,
                orientation[:3] if is_oriented else None,
                where=where,
            )
        )
    if not photos:
        raise lines.fail("the file has no photographs", "export a project with photographs")
    control = [(int(row[0]), row[1:4], lines.where) for _, row in lines.block("a control point", (7,))]
    points = [(int(row[0]), row[1:4]) for _, row in lines.block("a point", (7,))]
    marks = list(lines.block("a mark", (6,)))
    return _network(lines, cameras, photos, numbers, control, points, marks, float(default[0]))


def _camera(name: str, row: Array, size: Array, where: str) -> Camera:
    width, height = (int(length) for length in size)
    if not (row[0] > 0.0 and row[3] > 0.0 and row[4] > 0.0):
        raise SurveyError(
            "camera constant and format must be greater than 0", where=where, remedy="they are in millimetres"
        )
    # the format's width follows from the pixels' height: the affinity states how far they are from square
    inner = np.array([row[0], row[1], row[2], 0.0, 0.0, *row[5:]])
    return Camera(name, inner, (width, height), row[4] / height, where=where)


def _own_camera(cameras: list[Camera], parameters: Array, common: Array, size: Array, where: str) -> int:
    """Return the index of the camera of a photograph, whose values are printed with fewer digits."""
    if np.abs(parameters - common).max() <= _COARSE:
        return 0
    made = _camera(f"camera{len(cameras) + 1}", parameters, size, where)
    for number, camera in enumerate(cameras):
        if np.array_equal(camera.inner, made.inner) and camera.pixel == made.pixel:
            return number
    cameras.append(made)
    return len(cameras) - 1


def _network(
    lines: _Lines,
    cameras: list[Camera],
    photos: list[Photo],
    numbers: dict[int, int],
    control: list[tuple[int, Array, str]],
    points: list[tuple[int, Array]],
    marks: list[tuple[int, Array]],
    default: float,
) -> Network:
    shift, split = _smart_points([point for point, _ in points], marks)
    places = {number + (shift if k >= split else 0): place for k, (number, place) in enumerate(points)}
    for number, place, _ in control:
        places.setdefault(number, place)
    index = {number: k for k, number in enumerate(places)}
    photo, point, seen = list[int](), list[int](), dict[tuple[int, int], int]()
    for line, row in marks:
        lines.number = line
        of, number = int(row[0]), int(row[1]) + (shift if shift and not row[4:].any() else 0)
        if of not in numbers:
            raise lines.fail(
                f"a mark on photograph {of}, which is not in the file", "photographs count from 0"
            )
        if (first := seen.setdefault((of, number), line)) != line:
            raise lines.fail(
                f"point {number} is marked twice on photograph {of}, first in line {first}", "keep one"
            )
        photo.append(numbers[of])
        point.append(index.setdefault(number, len(index)))
    rows = np.array([row for _, row in marks]).reshape(-1, 6)
    start = np.array([places.get(number, np.full(3, np.nan)) for number in index]).reshape(-1, 3)
    sigma = np.where(rows[:, 4:] > 0.0, rows[:, 4:], default if default > 0.0 else 1.0)
    return Network(
        lines.text.path,
        tuple(cameras),
        tuple(photos),
        tuple(map(str, index)),
        start,
        tuple(
            Control(index[number], place, np.zeros((3, 3)), where=where) for number, place, where in control
        ),
        np.array(photo, dtype=np.int64),
        np.array(point, dtype=np.int64),
        rows[:, 2:4],
        sigma,
        np.array([line for line, _ in marks], dtype=np.int64),
    )


def _smart_points(numbers: list[int], marks: list[tuple[int, Array]]) -> tuple[int, int]:
    """Return what is added to the numbers of smart points, and the index of the first of these; 0 without any."""
    falls = [k + 1 for k, (a, b) in enumerate(pairwise(numbers)) if b < a]
    if len(falls) != 1 or not any(not row[4:].any() for _, row in marks):
        return 0, len(numbers)
    return max(numbers[: falls[0]]) + 1 - min(numbers[falls[0] :]), falls[0]


def write_photomodeler(network: Network, path: Path) -> None:
    """Write a network in this format, with all digits.

    Points are numbers in this format. Where one has another name, all are numbered, and NAME-points.txt beside the file
    has number and name of each.

    Raises
    ------
    SurveyError
        if a camera has another model or unit, affinity or skew, or cameras have different sizes: the format has no
        place
    """
    camera = network.cameras[0]
    for device in network.cameras:
        if device.forward or device.unit != "mm" or device.inner[3:5].any():
            raise SurveyError(
                f"camera {device.name}: {device.model} distortion, as {device.inner[3]:g}, "
                f"sk {device.inner[4]:g}, {device.unit}",
                where=str(path),
                remedy="this format holds backward distortion in millimetres, without affinity and skew",
            )
        if device.size != camera.size:
            raise SurveyError(
                f"cameras {camera.name} and {device.name} have photographs of different sizes",
                where=str(path),
                remedy="this format holds one size",
            )
    names = numbered(network, path.with_name(f"{path.stem}-points.txt"))

    def row(values: Sequence[float] | Array) -> str:
        """Return numbers as text that reads back to the same values."""
        return " ".join(repr(float(value)) for value in values)

    def of(camera: Camera) -> list[float]:
        """Return the parameters of a camera in the order of the file; lengths in mm."""
        inner = camera.inner.tolist()
        return [*inner[:3], camera.pixel * camera.size[0], camera.pixel * camera.size[1], *inner[5:]]

    none = row(np.zeros(10))
    text = ["moma", f"0.0005 20 {camera.size[0]} {camera.size[1]}", row(np.ones(9)), row(of(camera)), none]
    for k, photo in enumerate(network.photos):
        orientation = np.zeros(6)
        if photo.rotation is not None and photo.station is not None:
            orientation = np.concatenate([photo.station, np.degrees(angles(photo.rotation))[::-1]])
        camera_row = row(of(network.cameras[photo.camera]))
        text += [
            f"{k} {photo.name}",
            f"{k} {row(orientation)}",
            f"{k} {row(np.zeros(6))}",
            "",
            f"{k} {camera_row}",
            f"{k} {none}",
        ]
    sigmas = row(np.zeros(3))
    text.append("")
    text += [f"{names[gcp.point]} {row(gcp.place)} {sigmas}" for gcp in network.control]
    text.append("")
    located = np.isfinite(network.start).all(axis=1)
    text += [f"{names[i]} {row(network.start[i])} {sigmas}" for i in np.flatnonzero(located)]
    text.append("")
    for k in range(len(network.photo)):
        text.append(
            f"{network.photo[k]} {names[network.point[k]]} {row(network.image[k])} {row(network.sigma[k])}"
        )
    path.write_text("\n".join([*text, ""]), encoding="utf-8", newline="\n")
