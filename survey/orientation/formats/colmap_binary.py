"""Binary models of COLMAP: cameras.bin, images.bin and points3D.bin, little-endian, each a count and then records.

cameras.bin    id, model, width, height, parameters
images.bin     id, quaternion w x y z, translation, camera, name and a zero, count, then x, y, point of each mark
points3D.bin   id, place, colour, error, count, then image and mark of each observation
"""

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ground.errors import SurveyError
from ground.tables.numbers import unreadable
from survey.arrays import Array, Ints

MODELS: Mapping[str, Sequence[str]] = {
    "SIMPLE_PINHOLE": ("f", "cx", "cy"),
    "PINHOLE": ("fx", "fy", "cx", "cy"),
    "SIMPLE_RADIAL": ("f", "cx", "cy", "k1"),
    "RADIAL": ("f", "cx", "cy", "k1", "k2"),
    "OPENCV": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"),
    "OPENCV_FISHEYE": ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"),
    "FULL_OPENCV": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    "FOV": ("fx", "fy", "cx", "cy", "omega"),
    "SIMPLE_RADIAL_FISHEYE": ("f", "cx", "cy", "k"),
    "RADIAL_FISHEYE": ("f", "cx", "cy", "k1", "k2"),
    "THIN_PRISM_FISHEYE": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "sx1", "sy1"),
}
"""Camera models in the order of their numbers, and the names of their parameters."""

_NAMES = tuple(MODELS)

_MARK = np.dtype([("place", "<f8", 2), ("point", "<i8")])
_TRACK = struct.calcsize("<II")  # bytes of an observation of a point: image, and its mark


@dataclass(frozen=True)
class BinaryImage:
    """An image.

    Attributes
    ----------
    number, camera, name : as in the file
    pose : (7,) quaternion w, x, y, z and translation
    places : (n, 2) marks that have a point [px]
    points : (n,) numbers of these
    """

    number: int
    camera: int
    name: str
    pose: Array
    places: Array
    points: Ints


class _Bytes:
    """Content of a file that is read from its beginning to its end."""

    def __init__(self, path: Path, least: int) -> None:
        self.path, self.place = path, 0
        try:
            self.data = path.read_bytes()
        except OSError as error:
            raise unreadable(path, error, "export the model again") from error
        (self.count,) = self.take("<Q")
        if self.count * least > len(self.data):
            raise self.fail(f"the file announces {self.count} records, more than it has room for")

    def fail(self, what: str) -> SurveyError:
        """Return the error of this place in the file."""
        return SurveyError(what, where=f"{self.path}, byte {self.place}", remedy="export the model again")

    def skip(self, count: int) -> int:
        """Return the place before so many bytes that are there, and go on behind them."""
        before = self.place
        if count > len(self.data) - before:
            raise self.fail(f"the file ends {count - len(self.data) + before} bytes too early")
        self.place += count
        return before

    def take(self, form: str) -> tuple[int, ...]:
        """Read numbers of a `struct` format and move past them."""
        return struct.unpack_from(form, self.data, self.skip(struct.calcsize(form)))

    def text(self) -> str:
        """Read a text up to its zero byte and move past it; raise `SurveyError` where it has none."""
        end = self.data.find(b"\0", self.place)
        if end < 0:
            raise self.fail("a name without its end")
        return self.data[self.skip(end + 1 - self.place) : end].decode("utf-8", "replace")


def binary_cameras(path: Path) -> Iterator[tuple[int, str, tuple[int, int], list[float], str]]:
    """Yield number, name of the model, width and height, parameters and place of each camera.

    Raises
    ------
    SurveyError
        if the file is damaged
    """
    data = _Bytes(path, 24)
    for _ in range(data.count):
        where = f"{path}, byte {data.place}"
        number, model, width, height = data.take("<IiQQ")
        if not 0 <= model < len(_NAMES):
            raise data.fail(f"a camera model with the number {model}")
        name = _NAMES[model]
        values = [float(value) for value in data.take(f"<{len(MODELS[name])}d")]
        yield number, name, (width, height), values, where


def binary_images(path: Path) -> Iterator[BinaryImage]:
    """Yield the images.

    Raises
    ------
    SurveyError
        if the file is damaged
    """
    data = _Bytes(path, 4 + 7 * 8 + 4 + 1 + 8)
    for _ in range(data.count):
        (number,) = data.take("<I")
        pose = np.array(data.take("<7d"))
        (camera,) = data.take("<I")
        name = data.text()
        (count,) = data.take("<Q")
        start = data.skip(count * _MARK.itemsize)
        marks = np.frombuffer(data.data, _MARK, count, start)
        marks = marks[marks["point"] >= 0]
        yield BinaryImage(number, camera, name, pose, marks["place"].copy(), marks["point"].copy())


def binary_points(path: Path) -> dict[int, Array]:
    """Return the places (3,) of the points by their numbers.

    Raises
    ------
    SurveyError
        if the file is damaged
    """
    data, out = _Bytes(path, 8 + 3 * 8 + 3 + 8 + 8), dict[int, Array]()
    for _ in range(data.count):
        (number,) = data.take("<Q")
        out[number] = np.array(data.take("<3d"))
        data.skip(3 + 8)
        (count,) = data.take("<Q")
        data.skip(count * _TRACK)
    return out
