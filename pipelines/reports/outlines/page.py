"""The page that corrects outlines, written as one file that asks nothing of the network."""

import base64
import html
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from survey.arrays import Array

_LARGEST = 4096  # side of the picture in the page [px]: what every browser draws
_QUALITY = 85  # of its JPEG


@dataclass(frozen=True)
class PageDoubt:
    """A doubt that the page leads to.

    Attributes
    ----------
    stones : codes of one or two stones
    text : the doubt
    rank : the larger, the sooner it is shown
    x, y : its place in the wall's plane [m]
    """

    stones: tuple[str, ...]
    text: str
    rank: float
    x: float
    y: float


def editor_html(
    title: str,
    pixels: NDArray[np.uint8],
    matrix: Array,
    origin: Array,
    stones: Sequence[Mapping[str, Any]],
    doubts: Sequence[PageDoubt],
    facts: Sequence[tuple[str, str]],
) -> str:
    """Return the page.

    Parameters
    ----------
    title : of the page
    pixels : (h, w, 3) picture
    matrix, origin : (2, 2), (2,) from column and row of a pixel's middle to the wall's plane [m]
    stones : code, ring [m] and other attributes of each
    doubts : in any order
    facts : statistics of the bond as they were proposed, with their names
    """
    picture, factor = _jpeg(pixels)
    data = {
        "title": title,
        "picture": picture,
        "factor": factor,
        "width": pixels.shape[1],
        "height": pixels.shape[0],
        "matrix": matrix.tolist(),
        "origin": origin.tolist(),
        "stones": list(stones),
        "doubts": [asdict(doubt) for doubt in sorted(doubts, key=lambda doubt: -doubt.rank)],
        "facts": list(facts),
    }
    # no text of a survey ends the script that carries it
    text = json.dumps(data, ensure_ascii=False, allow_nan=False).replace("<", "\\u003c")
    page = _file("outlines.html")
    for mark, content in (
        ("{{title}}", html.escape(title)),
        ("{{style}}", _file("outlines.css")),
        ("{{script}}", _file("outlines.js")),
        ("{{data}}", text),
    ):
        before, _, after = page.partition(mark)
        page = before + content + after
    return page


def _file(name: str) -> str:
    return (files("pipelines.reports.outlines") / name).read_text(encoding="utf-8")


def _jpeg(pixels: NDArray[np.uint8]) -> tuple[str, float]:
    """Return a picture as an address of its data, and pixels of the original along one of it."""
    from PIL import Image

    picture = Image.fromarray(pixels)
    factor = max(1.0, max(picture.size) / _LARGEST)
    if factor > 1.0:
        picture = picture.resize((round(picture.width / factor), round(picture.height / factor)))
    out = io.BytesIO()
    picture.save(out, "JPEG", quality=_QUALITY)
    return "data:image/jpeg;base64," + base64.b64encode(out.getvalue()).decode("ascii"), factor
