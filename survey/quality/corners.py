"""Corners out of place in the plane of their face, where no fit of a plane can find them.

There are three signs of such a blunder. The face reaches into that of a neighbour. One of its angles is not usual for
its kind, and no neighbour follows its side, as a voussoir follows a skewback. Its size is that of no other stone of its
kind; several stones of an odd size, such as half bricks at the end of a wall, are a habit of the masons.
"""

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ground.statistics.scale import deviation
from survey.arrays import Array, Bools
from survey.conventions import BROKEN, ENOUGH, GROSS, MOST, ONE_WAY, SOME, WEAR, WIDEST_JOINT
from survey.geometry.polygons import ring_area, seamless
from survey.quality.facades import facades_of

_BESIDE = 0.25  # distance of two faces, one in front of the other, beyond which they do not collide [m]
_SPIKE = math.degrees(ONE_WAY)  # angle that no dressed stone of four corners or more has [degrees]
_ASKEW = 15.0  # least departure of an angle from those of its kind [degrees]: 8 cm on a side of 30 cm
_LARGER = SOME  # least departure of a size from that of its kind, over the median [-]
_ODD = (
    GROSS  # robust standard deviations from the median of the kind: quarries do not cut normal distributions
)
_CUT = BROKEN  # length of a side up to which it may be that of a corner broken off [m]
_ALIKE = MOST  # of the departure of one stone: that of another which is odd in the same way [-]
_COMPANY = 2  # other stones that are odd in the same way, from which it is a habit


class Sign(StrEnum):
    """Signs of a corner out of place, the surest first."""

    OVERLAP = "overlap"
    ANGLE = "angle"
    SIZE = "size"
    SEAM = "seam"


@dataclass(frozen=True)
class SeenFace:
    """Face of a stone that was measured.

    Attributes
    ----------
    code, kind : of the stone
    line : of the survey file, counted from 1
    normal : (3,) outward unit normal [-]
    outline : (nv, 3) corners, counter-clockwise seen from outside [m]
    worn : indices of the corners that lie off the plane, and of which nothing is expected
    area : [m²]
    length, height : level and upright extent [m]
    """

    code: str
    kind: str
    line: int
    normal: Array
    outline: Array
    worn: tuple[int, ...]
    area: float
    length: float
    height: float


@dataclass(frozen=True)
class Misplaced:
    """Sign that a corner of a stone is out of place.

    Attributes
    ----------
    code, line : of the stone
    sign : class of the sign
    severity : depth [m], departure of an angle [degrees], or departure of a size over the usual one [-]
    text : finding, with numbers
    """

    code: str
    line: int
    sign: Sign
    severity: float
    text: str


def misplaced_corners(faces: Sequence[SeenFace]) -> tuple[Misplaced, ...]:
    """Find the stones of which a corner seems out of place; one may have several signs.

    Parameters
    ----------
    faces : of all stones that were measured

    Returns
    -------
    overlaps first, then angles and sizes, the largest of each first
    """
    kinds: dict[str, list[SeenFace]] = defaultdict(list)
    for face in faces:
        kinds[face.kind].append(face)
    askew = {kind: _least_askew(members) for kind, members in kinds.items()}
    findings = [finding for members in kinds.values() for finding in _odd_sizes(members)]
    middles = np.array([face.outline.mean(axis=0) for face in faces]).reshape(-1, 3)
    for facade in facades_of(faces):
        members = [faces[i] for i in facade.members.tolist()]
        flat = [facade.frame.flatten(member.outline) for member in members]
        away = (middles[facade.members] - facade.frame.origin) @ facade.frame.axes[2]
        findings += [
            *_overlaps(members, flat, away),
            *_odd_angles(members, flat, askew),
            *_seams(members, flat),
        ]
    order = list(Sign)
    return tuple(
        sorted(findings, key=lambda finding: (order.index(finding.sign), -finding.severity, finding.code))
    )


def _overlaps(members: Sequence[SeenFace], flat: Sequence[Array], away: Array) -> Iterator[Misplaced]:
    """Yield both stones of each pair whose faces overlap deeply."""
    for i, j in _near(flat):
        if abs(away[i] - away[j]) > _BESIDE:
            continue
        common = _common(flat[i], flat[j])
        depth = _thickness(common)
        if depth > WEAR:
            for first, second in ((members[i], members[j]), (members[j], members[i])):
                text = f"its face overlaps that of {second.code} by {ring_area(common) * 1e4:.0f} cm²"
                yield Misplaced(first.code, first.line, Sign.OVERLAP, depth, text)


def _seams(members: Sequence[SeenFace], flat: Sequence[Array]) -> Iterator[Misplaced]:
    """Yield the first of two stones without a joint between them, where others have one."""
    for pair in seamless(flat, _near(flat, -WIDEST_JOINT)):
        first, second = members[pair.first], members[pair.second]
        text = (
            f"no joint parts it from {second.code} ({pair.gap * 1e3:.0f} mm; others are {pair.usual * 1e3:.0f} mm "
            "wide): one stone drawn as two?"
        )
        yield Misplaced(first.code, first.line, Sign.SEAM, pair.usual - pair.gap, text)


def _near(flat: Sequence[Array], deep: float = WEAR) -> Iterator[tuple[int, int]]:
    """Yield the pairs of polygons whose boxes overlap by a depth [m]; of a negative one, that are no farther apart."""
    low, high = np.array([one.min(axis=0) for one in flat]), np.array([one.max(axis=0) for one in flat])
    order = np.argsort(low[:, 0], kind="stable")
    starts = low[order, 0]
    for place, i in enumerate(order.tolist()):
        later = order[place + 1 : int(np.searchsorted(starts, high[i, 0] - deep))]
        common = np.minimum(high[later], high[i]) - np.maximum(low[later], low[i])
        yield from ((i, j) for j in later[common.min(axis=1, initial=np.inf) > deep].tolist())


def _common(one: Array, second: Array) -> Array:
    """Cut a polygon (n, 2) by the sides of another (m, 2), which is taken as convex; return what is left (k, 2)."""
    left = one
    for start, end in zip(second, np.roll(second, -1, axis=0), strict=True):
        if len(left) < 3:
            break
        run = end - start
        height = run[0] * (left[:, 1] - start[1]) - run[1] * (left[:, 0] - start[0])
        following, after = np.roll(left, -1, axis=0), np.roll(height, -1)
        pieces = []
        for k in range(len(left)):
            if height[k] >= 0.0:
                pieces.append(left[k])
            if height[k] * after[k] < 0.0:
                pieces.append(left[k] + height[k] / (height[k] - after[k]) * (following[k] - left[k]))
        left = np.array(pieces).reshape(-1, 2)
    return left


def _thickness(polygon: Array) -> float:
    """Return twice the area over the perimeter [m]: of a strip its width, of a triangle the radius of its circle."""
    around = float(np.linalg.norm(np.roll(polygon, -1, axis=0) - polygon, axis=1).sum())
    return 2.0 * ring_area(polygon) / around if around > 0.0 else 0.0


def _distances(points: Array, starts: Array, ends: Array) -> Array:
    """Return the distance of each point (n, 2) from each side (m, 2), (n, m) [m]."""
    sides, steps = ends - starts, points[:, None, :] - starts
    share = np.clip((steps * sides).sum(axis=2) / np.maximum((sides**2).sum(axis=1), 1e-300), 0.0, 1.0)
    out: Array = np.linalg.norm(steps - share[:, :, None] * sides, axis=2)
    return out


def _least_askew(faces: Sequence[SeenFace]) -> float:
    """Return the departure from a right angle beyond which an angle is odd for a kind [degrees]."""
    worst = [
        np.abs(_angles(face) - 90.0)[_sound_corners(face)].max(initial=0.0)
        for face in faces
        if len(face.outline) > 3
    ]
    if len(worst) < ENOUGH:
        return 90.0 - _SPIKE
    usual = np.median(worst)
    return float(usual + max(_ASKEW, _ODD * deviation(np.array(worst), float(usual))))


def _sound_corners(face: SeenFace) -> Bools:
    """Find the corners (nv,) that are neither worn nor an end of a short side, where a corner was broken off."""
    lengths = np.linalg.norm(np.roll(face.outline, -1, axis=0) - face.outline, axis=1)
    sound: Bools = np.minimum(lengths, np.roll(lengths, 1)) > _CUT
    sound[list(face.worn)] = False
    return sound


def _odd_angles(
    members: Sequence[SeenFace], flat: Sequence[Array], askew: Mapping[str, float]
) -> Iterator[Misplaced]:
    """Yield the stones with an odd angle at a corner, beside which a side has no neighbour."""
    for k, face in enumerate(members):
        if len(face.outline) < 4:
            continue
        angles = _angles(face)
        odd = _sound_corners(face) & (np.abs(angles - 90.0) > askew[face.kind])
        if not odd.any():
            continue
        if _is_alone(flat, k, odd):
            corner = int(np.argmax(np.where(odd, np.abs(angles - 90.0), 0.0)))
            at = ", ".join(f"{one:z.3f}" for one in face.outline[corner])
            text = f"its angle at ({at}) is {angles[corner]:.0f}°, and no neighbour follows its sides there"
            yield Misplaced(face.code, face.line, Sign.ANGLE, abs(float(angles[corner]) - 90.0), text)


def _is_alone(flat: Sequence[Array], k: int, odd: Bools) -> bool:
    """Return True if an oblique side at one of the odd corners of a face has no other face beside its middle."""
    sides = np.roll(flat[k], -1, axis=0) - flat[k]
    slopes = np.degrees(np.arctan2(sides[:, 1], sides[:, 0])) % 90.0
    oblique = np.minimum(slopes, 90.0 - slopes) > 0.5 * _ASKEW
    middles = (flat[k] + 0.5 * sides)[(odd | np.roll(odd, -1)) & oblique]
    others = [one for i, one in enumerate(flat) if i != k]
    if not others or not len(middles):
        return len(middles) > 0
    starts, ends = np.concatenate(others), np.concatenate([np.roll(one, -1, axis=0) for one in others])
    return bool((_distances(middles, starts, ends).min(axis=1) > WIDEST_JOINT).any())


def _angles(face: SeenFace) -> Array:
    """Return the angles (nv,) inside a face, from 0 to 360 [degrees]."""
    before, after = (
        np.roll(face.outline, 1, axis=0) - face.outline,
        np.roll(face.outline, -1, axis=0) - face.outline,
    )
    angles: Array = np.degrees(
        np.arctan2(np.cross(after, before) @ face.normal, (before * after).sum(axis=1))
    )
    return angles % 360.0


def _odd_sizes(faces: Sequence[SeenFace]) -> Iterator[Misplaced]:
    """Yield the stones with a length or a height that no other of their kind has."""
    if len(faces) < ENOUGH:
        return
    for name, word in (("length", "long"), ("height", "high")):
        sizes = np.array([getattr(face, name) for face in faces])
        usual = float(np.median(sizes))
        for k in np.flatnonzero(_outliers(sizes, _LARGER * usual)).tolist():
            text = f"its face is {sizes[k]:.3f} m {word}, the usual {faces[k].kind} {usual:.3f} m"
            yield Misplaced(faces[k].code, faces[k].line, Sign.SIZE, abs(sizes[k] / usual - 1.0), text)


def _outliers(values: Array, least: float) -> Bools:
    """Find the values (n,) that lie alone, far from the median and by at least `least` from it."""
    off = values - np.median(values)
    far = np.abs(off) > max(least, _ODD * deviation(off, 0.0))
    alike = np.array([(off * np.sign(offset) > _ALIKE * abs(offset)).sum() - 1 for offset in off])
    out: Bools = far & (alike < _COMPANY)
    return out
