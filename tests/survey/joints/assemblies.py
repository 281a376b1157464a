"""Assemblies of solids whose exact shape is known, and the same rounded to a millimetre."""

from itertools import pairwise

import numpy as np

from survey.arrays import Array
from survey.geometry.solids import Solid, area_vector

Polygon = tuple[int, ...]


def rounded(solids: list[Solid], digits: int = 3) -> list[Solid]:
    """Round coordinates to the decimals of a file."""
    return [Solid(one.code, np.round(one.vertices, digits), one.faces) for one in solids]


def outward(code: str, vertices: Array, faces: list[Polygon]) -> Solid:
    """Return a solid whose faces agree with each other, seen from outside."""
    middle = vertices.mean(axis=0)
    volume = sum(float((vertices[one[0]] - middle) @ area_vector(vertices[list(one)])) for one in faces)
    return Solid(code, vertices, tuple(faces if volume > 0.0 else [one[::-1] for one in faces]))


def prism(code: str, front: Array, back: Array) -> Solid:
    """Return the solid between two polygons (n, 3) with matching corners."""
    n = len(front)
    faces: list[Polygon] = [tuple(range(n)), tuple(range(2 * n - 1, n - 1, -1))]
    faces += [((i + 1) % n, i, i + n, (i + 1) % n + n) for i in range(n)]
    return outward(code, np.concatenate([front, back]), faces)


def wall(courses: int = 4, stones: int = 4, turn: float = 0.3, lean: float = 0.1) -> list[Solid]:
    """Return a running bond with half stones at its ends, turned about z by `turn` radians, and leaning."""
    out = []
    c, s = np.cos(turn), np.sin(turn)
    frame = np.array([[c, s, 0.0], [-s * np.cos(lean), c * np.cos(lean), -np.sin(lean)], np.zeros(3)])
    frame[2] = np.cross(frame[0], frame[1])
    for course in range(courses):
        joints = [
            0.0,
            *(k + (0.5 if course % 2 else 1.0) for k in range(stones - 1 + course % 2)),
            float(stones),
        ]
        for k, (a, b) in enumerate(pairwise(joints)):
            low, high = 0.3 * course, 0.3 * (course + 1)
            front = np.array([(a, 0, low), (b, 0, low), (b, 0, high), (a, 0, high)]) * [0.51, 1.0, 1.0]
            back = front + np.array([0.0, 0.37, 0.0])
            out.append(prism(f"W{course}-{k}", front @ frame, back @ frame))
    return out


def dome(rings: int = 3, around: int = 10, radius: float = 5.0, thickness: float = 0.6) -> list[Solid]:
    """Return rings of stones of six sides each, which all pass through the centre; both faces are hexagons.

    Each is a trapezoid to the left and one to the right of a fold, along the meridian through its middle; given as one
    polygon, as other programs do.
    """
    turn, rise = np.pi / around, 0.16

    def place(level: int, half: int, r: float) -> Array:
        up, about = 0.1 + rise * level, turn * half
        return r * np.array([np.cos(up) * np.cos(about), np.cos(up) * np.sin(about), np.sin(up)])

    out = []
    for ring in range(rings):
        for k in range(around):
            middle = 2 * k + ring % 2
            ids = [(ring, middle + j) for j in (-1, 0, 1)] + [(ring + 1, middle + j) for j in (1, 0, -1)]
            inner, outer = (np.array([place(*one, r) for one in ids]) for r in (radius, radius + thickness))
            out.append(prism(f"D{ring}-{k}", inner, outer))
    return out


def groin(
    stones: int = 3,
    angles: tuple[float, float] = (0.5, 1.2),
    radius: float = 3.0,
    thickness: float = 0.4,
    turn: float = 0.4,
) -> list[Solid]:
    """Return a groin of two barrel vaults: stones with an arm in each, mitred, and a straight stone at each arm.

    The angles are those of the lowest and the highest bed above level. All is turned about z by so many radians, so
    that rounding meets no plane by chance.
    """
    out: list[Solid] = []
    c, s = np.cos(turn), np.sin(turn)
    frame = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    for k, (low, high) in enumerate(pairwise(np.linspace(*angles, stones + 1))):
        profile = [(radius, low), (radius + thickness, low), (radius + thickness, high), (radius, high)]
        across = np.array([(r * np.cos(a), r * np.sin(a)) for r, a in profile])
        mitre = np.column_stack([across[:, 0], across[:, 0], across[:, 1]])
        # courses break joint along the arms
        ends = [6.0 + 0.5 * (k % 2), 7.0 + 0.5 * (k % 2)]
        rings = []
        for arm in range(2):
            for end in ends:
                ring = mitre.copy()
                ring[:, arm] = end
                rings.append(ring)
        mitre, rings = mitre @ frame, [ring @ frame for ring in rings]
        sides = [(i, (i + 1) % 4) for i in range(4)]
        faces: list[Polygon] = [(4, 5, 6, 7), (11, 10, 9, 8)]
        faces += [(i, j, 4 + j, 4 + i) for i, j in sides] + [(j, i, 8 + i, 8 + j) for i, j in sides]
        out.append(outward(f"G{k}", np.concatenate([mitre, rings[0], rings[2]]), faces))
        out += [prism(f"{name}{k}", rings[2 * n], rings[2 * n + 1]) for n, name in enumerate("AB")]
    return out


def obj(solids: list[Solid], digits: int | None = 3, doubled: bool = False) -> str:
    """Return the text of an OBJ file; every face twice if `doubled`."""
    rows, count = [], 0
    for one in solids:
        rows.append(f"o {one.code}")
        places = one.vertices.tolist()
        if digits is None:
            rows += [f"v {x!r} {y!r} {z!r}" for x, y, z in places]
        else:
            rows += [f"v {x:.{digits}f} {y:.{digits}f} {z:.{digits}f}" for x, y, z in places]
        faces = [f"f {' '.join(str(count + i + 1) for i in face)}" for face in one.faces]
        rows += faces * (2 if doubled else 1)
        count += len(places)
    return "\n".join(rows) + "\n"
