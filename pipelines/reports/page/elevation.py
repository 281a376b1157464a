"""Line drawing of an elevation to scale, as SVG: outlines and codes, for print and for drawing programs."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup, escape

from mechanics.arrays import Array, Ints
from pipelines.reports.page.model import Model
from survey.conventions import SOME

_WIDE, _HIGH = 170.0, 200.0  # room on a sheet of A4, portrait [mm]
_ROUND = (1, 2, 5)
_SCALES = [scale * 10**power for power in range(4) for scale in (5, 10, 20, 25)]
_FRONT = SOME  # cosine to the observer from which a face is drawn [-]
_LETTER = 2.0  # height of a code [mm]
_BROAD = 0.62  # width of a letter over its height [-]


@dataclass(frozen=True)
class Elevation:
    """A drawing: SVG with sizes in millimetres of paper, and its scale, 1 : `scale`."""

    svg: Markup
    scale: int
    drawn: int


def elevation(model: Model, most: int = 6000, scale: int | None = None) -> Elevation | None:
    """Draw the main elevation; None if more than `most` faces are seen, or none.

    Faces that look at the observer are drawn from the farthest to the nearest, so that near ones cover far ones; exact
    where stones do not reach around each other.

    Parameters
    ----------
    model : its stones, as at the start, and the direction of its main elevation
    most : faces of a drawing
    scale : 1 : scale; None: the largest usual one at which it fits a sheet of A4
    """
    stones = model.stones
    if not len(stones.triangles):
        return None
    axes = _frame(np.asarray(model.towards, dtype=float))
    flat = stones.vertices @ axes.T
    faces = _faces(stones.vertices, stones.triangles, stones.owner, axes[2])
    if not faces or len(faces) > most:
        return None
    low, high = flat[:, :2].min(axis=0), flat[:, :2].max(axis=0)
    size = 1e3 * (high - low)
    fitting = [scale for scale in _SCALES if (size / scale <= (_WIDE, _HIGH)).all()]
    chosen = scale or (fitting[0] if fitting else int(np.ceil(size.max() / _WIDE)))
    order = sorted(faces, key=lambda face: float(flat[face[1], 2].max()))
    paper = (flat[:, :2] - low) * [1.0, -1.0] * 1e3 / chosen + [0.0, size[1] / chosen]
    parts = [_outline(paper[loop]) for _, loop in order]
    wide, high_mm = size / chosen
    codes = _codes(paper, order, stones.codes)
    bar = _bar(chosen, float(high_mm), float(wide))
    svg = (
        f'<svg xmlns="http://www.w3.org/2000/svg" class="elevation" '
        f'width="{wide + 4:.1f}mm" height="{high_mm + 14:.1f}mm" '
        f'viewBox="-2 -2 {wide + 4:.2f} {high_mm + 14:.2f}" role="img" aria-label="elevation, 1 : {chosen}">'
        f'<g fill="#fff" stroke="#000" stroke-width="0.18" stroke-linejoin="round">{"".join(parts)}</g>'
        f'<g font-family="sans-serif" font-size="{_LETTER}" text-anchor="middle">{codes}</g>{bar}</svg>'
    )
    return Elevation(Markup(svg), chosen, len(faces))


def _frame(towards: Array) -> Array:
    """Return rows: to the right of the observer, up in the picture, to the observer."""
    level = np.array([towards[0], towards[1], 0.0])
    if np.linalg.norm(level) < 0.1 * np.linalg.norm(towards):
        return np.eye(3)
    back = level / np.linalg.norm(level)
    return np.array([[-back[1], back[0], 0.0], [0.0, 0.0, 1.0], back])


def _faces(vertices: Array, triangles: Ints, owner: Ints, back: Array) -> list[tuple[int, Ints]]:
    """Return stone and outline, as rows of vertices, of each flat part of a surface that looks at the observer."""
    corners = vertices[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1)
    seen = (normal @ back) > _FRONT * np.maximum(size, 1e-300)
    chosen, directions = triangles[seen], (normal / np.maximum(size, 1e-300)[:, None])[seen]
    stones, rounded = owner[chosen[:, 0]], np.round(directions, 2) + 0.0
    groups: dict[tuple[int, bytes], list[int]] = {}
    for row, (stone, key) in enumerate(zip(stones.tolist(), rounded, strict=True)):
        groups.setdefault((stone, key.tobytes()), []).append(row)
    return [(stone, loop) for (stone, _), rows in groups.items() for loop in _loops(chosen[rows])]


def _loops(triangles: Ints) -> list[Ints]:
    """Return the outlines of triangles that lie in one plane: sides that belong to one of them."""
    sides = [(int(t[i]), int(t[(i + 1) % 3])) for t in triangles for i in range(3)]
    known = set(sides)
    after: dict[int, int] = {a: b for a, b in sides if (b, a) not in known}
    loops = []
    while after:
        first, here = next(iter(after.items()))
        del after[first]
        loop = [first]
        while here != first and here in after:
            loop.append(here)
            here = after.pop(here)
        loops.append(np.array(loop))
    return loops


def _outline(points: Array) -> str:
    text = "L".join(f"{x:.2f} {y:.2f}" for x, y in points.tolist())
    return f'<path d="M{re.sub(r"[.]00(?=[ L]|$)", "", text)}Z"/>'


def _codes(paper: Array, faces: list[tuple[int, Ints]], codes: Sequence[str]) -> str:
    """Return the codes of the stones whose largest face has room for them."""
    largest: dict[int, tuple[float, Array, Array]] = {}
    for stone, loop in faces:
        low, high = paper[loop].min(axis=0), paper[loop].max(axis=0)
        area = float(np.prod(high - low))
        if area > largest.get(stone, (0.0,))[0]:
            largest[stone] = (area, low, high)
    labels = []
    for stone, (_, low, high) in largest.items():
        code = codes[stone]
        wide, tall = high - low
        if tall > 1.2 * _LETTER and wide > _BROAD * _LETTER * len(code):
            x, y = (low + high) / 2
            labels.append(f'<text x="{x:.1f}" y="{y + 0.35 * _LETTER:.1f}">{escape(code)}</text>')
    return "".join(labels)


def _bar(scale: int, below: float, wide: float) -> str:
    """Return a bar of a round length, at most a third of the width."""
    metres = max(
        (
            digit * 10.0**power
            for power in range(-2, 4)
            for digit in _ROUND
            if digit * 10.0**power * 1e3 / scale < wide / 3
        ),
        default=0.01,
    )
    long = metres * 1e3 / scale
    y = below + 4.0
    return (
        f'<g stroke="#000" stroke-width="0.3"><path d="M0 {y - 1:.1f}V{y:.1f}H{long:.2f}V{y - 1:.1f}" fill="none"/></g>'
        f'<text x="{long + 2:.1f}" y="{y:.1f}" font-family="sans-serif" font-size="3">{metres:g} m, 1 : {scale}</text>'
    )
