"""Calibrations of OpenCV, as its FileStorage and ROS write them: camera matrix, distortion, and size of the picture.

The middle of the first pixel is (0, 0) there and (0.5, 0.5) here. Distortion is forward, of coordinates over the depth.
"""

import re
from pathlib import Path

import numpy as np

from ground.errors import SurveyError
from ground.tables.numbers import parse_number, unreadable
from survey.arrays import Array
from survey.orientation.formats.xml_lines import read_xml
from survey.orientation.network import Camera

_COEFFICIENTS = ("k1", "k2", "p1", "p2", "k3")  # further ones belong to other models
_FIRST_PIXEL = 0.5  # place of the middle of the first pixel [px]
_NAMES = {
    "matrix": ("cameramatrix", "k", "mtx", "intrinsicmatrix", "intrinsics"),
    "distortion": ("distortioncoefficients", "distcoeffs", "dist", "d"),
    "width": ("imagewidth", "width"),
    "height": ("imageheight", "height"),
    "model": ("distortionmodel",),
}
"""Names of the entries without case and underscores, as programs write them."""


def read_calibration(path: Path, name: str) -> Camera:
    """Read a calibration in YAML or XML as a camera in pixels.

    Parameters
    ----------
    name : of the camera

    Raises
    ------
    SurveyError
        if it is none, or of a model with rational, thin-prism or fisheye distortion
    """
    entries = _entries(path)
    if "matrix" not in entries or "distortion" not in entries:
        raise SurveyError(
            "the file has no camera matrix with distortion coefficients",
            where=str(path),
            remedy="give a calibration that OpenCV's FileStorage wrote, in YAML or XML",
        )
    matrix, coefficients = (_numbers(entries[one], path) for one in ("matrix", "distortion"))
    model = " ".join(entries.get("model", []))
    if (
        len(matrix) != 9
        or matrix[1]
        or any(coefficients[len(_COEFFICIENTS) :])
        or model in ("equidistant", "fisheye")
    ):
        raise SurveyError(
            "its camera has skew, or a rational, thin-prism or fisheye distortion",
            where=str(path),
            remedy="calibrate with k1, k2, p1, p2, k3 alone",
        )
    if "width" not in entries or "height" not in entries:
        raise SurveyError(
            "the file does not state the size of the pictures",
            where=str(path),
            remedy="add image_width and image_height in pixels",
        )
    width, height = (int(_numbers(entries[one], path)[0]) for one in ("width", "height"))
    values = {
        "fx": matrix[0],
        "fy": matrix[4],
        "cx": matrix[2] + _FIRST_PIXEL,
        "cy": matrix[5] + _FIRST_PIXEL,
    }
    values |= dict(zip(_COEFFICIENTS, coefficients, strict=False))
    return Camera(name, interior(values), (width, height), 1.0, "px", True, where=str(path))


def interior(values: dict[str, float]) -> Array:
    """Return the interior orientation (10,) of the parameters f or fx and fy, cx, cy, k1, k2, k3, p1, p2."""
    c = values.get("fy", values.get("f", 0.0))
    k1, k2, k3 = (values.get(name, 0.0) for name in ("k1", "k2", "k3"))
    return np.array(
        [
            c, values["cx"], values["cy"], values.get("fx", c) / c - 1.0, 0.0,
            k1 / c**2, k2 / c**4, k3 / c**6, values.get("p2", 0.0) / c, -values.get("p1", 0.0) / c,
        ]
    )  # fmt: skip


def _entries(path: Path) -> dict[str, list[str]]:
    """Return the words of each entry that is known."""
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise unreadable(path, error, "name the calibration") from error
    if text.lstrip().startswith("<"):
        found = {
            child.name: (child.find("data") or child).text.split()
            for child in read_xml(path, "opencv_storage").children
        }
    else:
        rows = re.findall(
            r"^(\w+):[^\n]*(?:\n[ \t]+(?:rows|cols|dt):[^\n]*)*\n[ \t]+data:\s*\[([^]]*)\]",
            text,
            re.MULTILINE,
        )
        rows += re.findall(r"^(\w+):[ \t]*([^\s!\[{][^\n]*)$", text, re.MULTILINE)
        found = {name: words.replace(",", " ").split() for name, words in rows}
    plain = {name.replace("_", "").lower(): words for name, words in found.items()}
    return {
        what: words
        for what, names in _NAMES.items()
        for name in names
        if (words := plain.get(name)) is not None
    }


def _numbers(words: list[str], path: Path) -> list[float]:
    return [parse_number(word, "a value", str(path)) for word in words]
