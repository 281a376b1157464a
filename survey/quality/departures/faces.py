"""Departure of a wall's faces from its plane and from plumb, and the stones that stand out of it.

Faces whose neighbours lie within a hand's breadth of each other's plane make one wall; a buttress is another. Each
stone is compared with the plane through its nearest neighbours, fitted robustly (Tukey's bisquare): proud, sunk or
turned is what departs by more than chance. The scatter of faces is that of all stones about their neighbours, without
outliers, so that rough masonry has wide limits and one odd stone does not widen them. What the sound stones share is
movement: they are tested together for lean, bulge, bow, an end or a corner that comes forward, an offset along an
upright joint, and a setback (`survey.quality.departures.shapes`).
"""

import math
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ground.statistics.scale import spread
from survey.arrays import Array
from survey.conventions import (
    ATTEMPTS,
    BROKEN,
    ENOUGH,
    FINEST,
    GROUP,
    LEAST,
    PARALLEL,
    ROUNDS,
    STONE,
    TENTH,
    TUKEY,
)
from survey.quality.departures.bulges import bulge_profile, with_extent_and_profile
from survey.quality.departures.shapes import (
    LIKELY,
    MOST,
    Found,
    Sample,
    Shape,
    critical,
    fit_shapes,
    millimetres,
    powers,
)
from survey.quality.facades import Facade
from survey.quality.precision import StoneQuality

_NEIGHBOURS = 10  # stones with which one is compared
_JOINED = BROKEN  # departure of neighbours from each other's plane within which they are of one wall [m]
_WALL = 6  # least number of stones of a wall of its own; fewer stand out of the one behind them
_MIN_NEIGHBOURS = ENOUGH  # least number of neighbours of a plane
_REACH = 6.0  # of the median size of a stone: distance of neighbours
_TURNED = math.degrees(
    PARALLEL
)  # largest angle of a face to its wall [degrees]: splayed jambs are not of the wall
_PER_STONE = 0.7  # degrees of freedom that a stone gives the scatter: neighbours are in each other's planes
_PROJECTING = frozenset({"cornice", "coping", "corbel", "sill", "base", "capital", "slab", "boss"})
_SIMPLEST_FIRST = (
    ("lean",),
    ("bulge", "bow"),
    ("setback", "offset"),
    ("left end", "right end", "left corner", "right corner", "leaning part"),
    ("local bulge",),
)
_RANKS = {name: rank for rank, names in enumerate(_SIMPLEST_FIRST) for name in names}
_GRID = 8  # places along and up the wall at which ends, offsets and bulges are looked for
_MIN_MOVED_STONES = GROUP  # stones that a shape must move
_BESIDE = 1.0  # of the median size of a stone: distance from a straight joint to which a crack zigzags
_TRIALS = ATTEMPTS  # by which the place of a shape is sharpened
_STEP = TENTH  # of the median size of a stone: step of the derivatives of a bulge by its places


class FaceKind(StrEnum):
    """Families of movement out of the plane of a wall."""

    LEAN = "lean"
    BULGE = "bulge"
    BOW = "bow"
    LEFT_END = "left end"
    RIGHT_END = "right end"
    LEFT_CORNER = "left corner"
    RIGHT_CORNER = "right corner"
    OFFSET = "offset"
    SETBACK = "setback"
    LEANING_PART = "leaning part"
    LOCAL_BULGE = "local bulge"


@dataclass(frozen=True)
class FaceMovement:
    """A movement out of the plane that the stones of a wall share.

    Attributes
    ----------
    facade, zone : wall
    kind : its family
    left, right, low, high : extent, along the facade and in height [m]
    amount, sigma : outwards: of the top over the base, of the middle over the chord, of the end, the corner or the
        top of a part over the rest, of the right over the left side, of the upper over the lower part [m]
    probability : that as much is found anywhere in a wall that has not moved
    """

    facade: str
    zone: str | None
    kind: FaceKind
    left: float
    right: float
    low: float
    high: float
    amount: float
    sigma: float
    probability: float

    @property
    def text(self) -> str:
        """The movement in a sentence."""
        size = millimetres(self.amount, self.sigma)
        direction = "outwards" if self.amount > 0.0 else "inwards"
        over = f"over {self.high - self.low:.2f} m"
        stands = f"stands {size} {'forward of' if self.amount > 0.0 else 'behind'}"
        bulges = f"{'bulges' if self.amount > 0.0 else 'is hollow'} by {size}"
        angle = math.degrees(math.atan2(abs(self.amount), max(self.high - self.low, 1e-9)))
        where = f"from {self.left:z.2f} to {self.right:z.2f} m"
        return {
            "lean": f"it leans {direction} by {size} {over} ({angle:.2f}°), or was built with a batter",
            "bulge": f"it {bulges} between base and top",
            "bow": f"it bows {direction} by {size} between its ends, or was built round",
            "left end": f"its left end, {where}, comes {direction} by {size}",
            "right end": f"its right end, {where}, comes {direction} by {size}",
            "left corner": f"its left corner, {where}, leans {direction} by {size} {over}",
            "right corner": f"its right corner, {where}, leans {direction} by {size} {over}",
            "offset": f"its right part, {where}, {stands} the left",
            "setback": f"from {self.low:.2f} m up it {stands} what is below: slid, or built so",
            "leaning part": f"its part {where} leans {direction} as one by {size} {over} ({angle:.2f}°), "
            "parted by a joint",
            "local bulge": f"it {bulges} {where} and {self.low:.2f} to {self.high:.2f} m up",
        }[self.kind]


@dataclass(frozen=True)
class OddStone:
    """A stone out of the face of its wall.

    Attributes
    ----------
    code, line : of the stone
    sort : "proud", "sunk" or "turned"
    amount, sigma : outwards of the plane of its neighbours [m]; of the turned the angle to it [rad]
    """

    code: str
    line: int
    sort: str
    amount: float
    sigma: float

    @property
    def text(self) -> str:
        """The departure in words."""
        if self.sort == "turned":
            size = f"{math.degrees(self.amount):.1f} ± {math.degrees(self.sigma):.1f}°"
            return f"its face is turned by {size} against those around it"
        return f"it stands {self.sort} by {millimetres(self.amount, self.sigma, 0)} of those around it"


@dataclass(frozen=True)
class WallFace:
    """Findings about the face of a wall.

    Attributes
    ----------
    facade, zone : wall
    stones : (m,) indices of its stones, in the order given
    scatter : standard deviation of a face about its neighbours, beyond the measurement [m]
    lean, lean_sigma : outward lean of its best plane [rad]
    plane : (m,) departure of each stone from the best plane, outwards [m]
    plumb : (m,) the same from the upright plane [m]
    movements : found, the most significant first
    odd : stones out of the face, the most significant first
    excluded : smallest lean, from base to top, and bulge that would have been found in 95 of 100 surveys [m]; None if
        they could not be tested
    excluded_stone : smallest departure of one stone that would have been found [m]
    """

    facade: str
    zone: str | None
    stones: NDArray[np.intp]
    scatter: float
    lean: float
    lean_sigma: float
    plane: Array
    plumb: Array
    movements: tuple[FaceMovement, ...]
    odd: tuple[OddStone, ...]
    excluded: float | None
    excluded_stone: float | None


@dataclass(frozen=True)
class _Face:
    """Faces of one wall: place along it, up and outwards, with the standard deviation of that; directions."""

    rows: NDArray[np.intp]
    codes: Sequence[str]
    lines: Sequence[int]
    along: Array
    up: Array
    out: Array
    sigma: Array
    turn: Array = field(repr=False)
    turn_sigma: Array = field(repr=False)
    size: float = STONE
    bottom: float = 0.0

    def of(self, rows: NDArray[np.intp]) -> "_Face":
        """Return some of the faces."""
        arrays = {
            name: getattr(self, name)[rows]
            for name in ("rows", "along", "up", "out", "sigma", "turn", "turn_sigma")
        }
        chosen = rows.tolist()
        return replace(
            self, codes=[self.codes[i] for i in chosen], lines=[self.lines[i] for i in chosen], **arrays
        )


def find_face_departures(
    stones: Sequence[StoneQuality],
    facades: Sequence[Facade],
    alpha: float,
    tilts: Mapping[str, float] | None = None,
) -> tuple[WallFace, ...]:
    """Find the movements of the faces of all walls of a survey, and the stones out of them.

    Parameters
    ----------
    stones : all stones of the survey; those whose place was not measured are left out
    facades : of the stones; level ones have no plumb
    alpha : probability that a survey without any departure is given one
    tilts : standard deviation of the lean of the frame by facade, where control points levelled it [rad]
    """
    faces = [face for facade in facades if facade.azimuth is not None for face in _faces(stones, facade)]
    share = alpha / max(len(faces), 1)
    return tuple(_wall(name, zone, face, share, (tilts or {}).get(name, 0.0)) for name, zone, face in faces)


def _faces(stones: Sequence[StoneQuality], facade: Facade) -> Iterator[tuple[str, str | None, _Face]]:
    """Yield the walls of a facade: by zone, and by the plane in which they stand."""
    axes = facade.frame.axes.copy()
    axes[2] = axes[2] * [1.0, 1.0, 0.0]
    axes[2] /= np.linalg.norm(axes[2])
    zones: dict[str | None, list[int]] = defaultdict(list)
    for i in facade.members.tolist():
        stone = stones[i]
        known = stone.source in ("points", "photograph") and math.isfinite(stone.offset_sigma)
        if known and stone.kind not in _PROJECTING:
            zones[stone.zone].append(i)
    for zone, members in zones.items():
        wall_stones = [stones[i] for i in members]
        centres = (
            np.array([wall_stone.outline.mean(axis=0) for wall_stone in wall_stones]) - facade.frame.origin
        )
        normals = np.array([wall_stone.normal for wall_stone in wall_stones])
        turn = np.column_stack([normals @ axes[0], normals[:, 2]]) / (normals @ axes[2])[:, None]
        straight = np.abs(turn - np.median(turn, axis=0)).max(axis=1) < math.tan(math.radians(_TURNED))
        face = _Face(
            np.array(members, dtype=np.intp),
            [wall_stone.code for wall_stone in wall_stones],
            [wall_stone.line for wall_stone in wall_stones],
            centres @ axes[0],
            centres[:, 2] + facade.frame.origin[2],
            centres @ axes[2],
            np.array([_offset_sigma(wall_stone) for wall_stone in wall_stones]),
            turn,
            np.radians(np.array([wall_stone.tilt_sigma for wall_stone in wall_stones])),
            float(np.median([math.sqrt(wall_stone.area) for wall_stone in wall_stones])),
            min(float(wall_stone.outline[:, 2].min()) for wall_stone in wall_stones),
        )
        if straight.sum() < _WALL:
            continue
        face = face.of(np.flatnonzero(straight))
        for plane in _planes(face):
            yield facade.name, zone, face.of(plane)


def _offset_sigma(stone: StoneQuality) -> float:
    """Return the standard deviation of a face's place; points that were left out by chance make it too small."""
    left_out = len(stone.blunders) + len(stone.worn)
    return max(stone.offset_sigma, FINEST) * (1.0 + 2.0 * left_out / max(stone.points, 1))


def _planes(face: _Face) -> list[NDArray[np.intp]]:
    """Part faces that stand in planes of their own; single stones stay with the wall nearest to them."""
    places = np.column_stack([face.along, face.up])
    pairs = cKDTree(places).query_pairs(_REACH / 3.0 * face.size, output_type="ndarray")
    slope = np.median(face.turn, axis=0)
    level = face.out + places @ slope
    joined = pairs[np.abs(level[pairs[:, 0]] - level[pairs[:, 1]]) < _JOINED]
    size = len(places)
    graph = coo_array((np.ones(len(joined)), (joined[:, 0], joined[:, 1])), shape=(size, size))
    _, label = connected_components(graph, directed=False)
    counts = np.bincount(label)
    large = np.flatnonzero(counts >= _WALL)
    if len(large) == 0:
        return []
    alone = np.flatnonzero(counts[label] < _WALL)
    walls = [np.flatnonzero(label == k) for k in large.tolist()]
    members = np.concatenate(walls)
    if len(alone):
        # an odd stone stands out of the wall that is beside it
        nearest = np.asarray(cKDTree(places[members]).query(places[alone])[1])
        label = label.copy()
        label[alone] = label[members][nearest]
        walls = [np.flatnonzero(label == k) for k in large.tolist()]
    return walls


def _wall(name: str, zone: str | None, face: _Face, alpha: float, tilt: float) -> WallFace:
    freedom = max(_PER_STONE * len(face.codes), 1.0)
    limit = critical(alpha / 2.0, 3 * len(face.codes), freedom)
    movements: list[Found] = []
    odd: list[OddStone] = []
    for _ in range(ROUNDS):
        # what the wall has taken is taken out: a stone beside a crack is no odd one
        moved = sum(
            (movement.amount * _field(movement.shape, face) for movement in movements),
            np.zeros(len(face.codes)),
        )
        away, away_sigma, scatter = _beside(replace(face, out=face.out - moved))
        crossing = _crossing(face, movements, away, limit * away_sigma)
        before, odd = odd, _odd(face, limit, (np.where(crossing, 0.0, away), away_sigma), _turned(face))
        strange = np.isin(face.codes, [stone.code for stone in odd if stone.sort != "turned"]) | crossing
        sound = np.flatnonzero(~strange)
        sound_face = face.of(sound)
        movements, lower = _movements(sound_face, scatter, alpha / 2.0, freedom, tilt)
        if not movements or len(movements) >= MOST or [o.code for o in odd] == [o.code for o in before]:
            break
    if len(movements) >= MOST:  # as many shapes as are looked for leave some still: these faces make no plane
        movements, lower = [], None
    judged = _judged_bulges(sound_face, _sample(sound_face, scatter, freedom, tilt), movements)
    told = tuple(_told(name, zone, sound_face, movement) for movement in judged)
    plane, plumb, lean, sigma = _departures(face, sound, scatter)
    return WallFace(
        name,
        zone,
        face.rows,
        scatter,
        lean,
        math.hypot(sigma, tilt),
        plane,
        plumb,
        told,
        tuple(sorted(odd, key=lambda stone: -abs(stone.amount) / stone.sigma)),
        lower,
        (limit + LIKELY) * float(np.median(away_sigma)) if len(away) else None,
    )


def _crossing(face: _Face, movements: Sequence[Found], away: Array, limit: Array) -> NDArray[np.bool_]:
    """Return the stones beside the joint of a part that moved with its other side: cracks zigzag around stones."""
    crossing = np.zeros(len(face.codes), dtype=bool)
    for movement in movements:
        if movement.shape.name not in ("leaning part", "offset"):
            continue
        inside = _field(movement.shape, face) != 0.0
        for edge in movement.shape.places[:2]:
            beside = np.abs(face.along - edge) <= _BESIDE * face.size
            if movement.shape.name == "offset":
                change = np.where(inside, movement.amount, -movement.amount)
            else:
                share = (face.up - movement.shape.places[2]) / (
                    movement.shape.places[3] - movement.shape.places[2]
                )
                change = np.where(inside, movement.amount, -movement.amount) * share
            crossing |= beside & (np.abs(away) > limit) & (np.abs(away + change) <= limit)
    return crossing


def _odd(
    face: _Face, limit: float, beside: tuple[Array, Array], turns: tuple[Array, Array]
) -> list[OddStone]:
    """Return the stones that depart from the plane of their neighbours, or are turned against them, beyond a limit."""
    (away, away_sigma), (turned, turned_sigma) = beside, turns
    odd = [
        OddStone(
            face.codes[i],
            face.lines[i],
            "proud" if away[i] > 0.0 else "sunk",
            float(away[i]),
            float(away_sigma[i]),
        )
        for i in np.flatnonzero(np.abs(away) > np.maximum(limit * away_sigma, LEAST)).tolist()
    ]
    for i in np.flatnonzero((np.abs(turned) > limit * turned_sigma).any(axis=1)).tolist():
        k = int((np.abs(turned[i]) / turned_sigma[i]).argmax())
        amount, sigma = float(abs(turned[i, k])), float(turned_sigma[i, k])
        odd.append(OddStone(face.codes[i], face.lines[i], "turned", amount, sigma))
    return odd


def _beside(face: _Face) -> tuple[Array, Array, float]:
    """Return the departure of each stone from the plane of its neighbours, its σ, and the scatter of faces [m]."""
    count = len(face.codes)
    places = np.column_stack([face.along, face.up])
    near = _NEIGHBOURS if count > _NEIGHBOURS else count - 1
    distance, index = _nearest(places, near + 1)
    distant = distance[:, 1:] > _REACH * face.size
    distant[:, :_MIN_NEIGHBOURS] = False
    index = index[:, 1:]
    rows = np.stack([np.ones(index.shape), *(places[index] - places[:, None]).transpose(2, 0, 1)], axis=2)
    values = face.out[index]
    scatter = 0.0
    # the first weights know no plane, only the median of the neighbours: one odd stone would turn a plane
    first = values - np.median(values, axis=1)[:, None]
    weights = _bisquare(np.abs(first) / max(spread(first[~distant]), 1e-9), distant)
    for _ in range(4):
        variance = face.sigma**2 + scatter**2
        normal = np.einsum("nki,nk,nkj->nij", rows, weights / variance[index], rows)
        normal += 1e-9 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(3)
        right = np.einsum("nki,nk->ni", rows, weights / variance[index] * values)
        solved = np.linalg.solve(normal, right[..., None])[..., 0]
        rest = values - np.einsum("nki,ni->nk", rows, solved)
        away = face.out - solved[:, 0]
        inverse = np.linalg.inv(normal)
        predicted = inverse[:, 0, 0]
        share = 1.0 + predicted / variance  # variance of the departure over that of a face
        found = spread(away / np.sqrt(share))
        scatter = math.sqrt(max(found**2 - float(np.median(face.sigma**2)), 0.0))
        weights = _bisquare(np.abs(rest) / np.sqrt(face.sigma[index] ** 2 + scatter**2), distant)
    sigma = np.sqrt(face.sigma**2 + scatter**2 + predicted)
    return away, sigma, scatter


def _bisquare(size: Array, distant: NDArray[np.bool_]) -> Array:
    """Return Tukey's weights (n, k) of residuals over their σ; those of neighbours that are all far off stay equal."""
    share = np.minimum(size / TUKEY, 1.0)
    weights = np.where(distant, 0.0, (1.0 - share**2) ** 2)
    lost = weights.sum(axis=1) < 3.0
    weights[lost] = np.where(distant[lost], 0.0, 1.0)
    return np.asarray(weights, dtype=np.float64)


def _nearest(places: Array, count: int) -> tuple[Array, NDArray[np.intp]]:
    """Return distance and index of the nearest places of each place (n, 2), itself first, (n, count)."""
    distance, index = cKDTree(places).query(places, k=count)
    return np.asarray(distance), np.asarray(index)


def _turned(face: _Face) -> tuple[Array, Array]:
    """Return the turn of each face about the upright and the level axis against its neighbours, and its σ [rad]."""
    count = len(face.codes)
    places = np.column_stack([face.along, face.up])
    neighbours = _NEIGHBOURS if count > _NEIGHBOURS else count - 1
    index = _nearest(places, neighbours + 1)[1][:, 1:]
    turned = face.turn - np.median(face.turn[index], axis=1)
    measured = np.where(np.isfinite(face.turn_sigma), face.turn_sigma, np.inf)
    # a median of k is by π/2 less certain than their mean
    grown = math.sqrt(1.0 + 0.5 * math.pi / neighbours)
    finite = np.isfinite(measured)
    sigma = np.full(turned.shape, np.inf)
    for k in range(2):
        if finite.any():
            excess = max(spread(turned[finite, k] / (grown * measured[finite])), 1.0)
            sigma[:, k] = grown * excess * measured
    return turned, sigma


def _movements(
    face: _Face, scatter: float, alpha: float, freedom: float, tilt: float
) -> tuple[list[Found], float | None]:
    shapes = list(_shapes(face))
    if len(face.codes) < _WALL or not shapes:
        return [], None
    columns = np.column_stack([_field(shape, face) for shape in shapes])
    sample = _sample(face, scatter, freedom, tilt)
    found, limit = fit_shapes(sample, shapes, columns, [(0, 0)], alpha, _sharpener(face))
    sigma = powers(
        sample, columns[:, [k for k, shape in enumerate(shapes) if shape.name in ("lean", "bulge")]], (0, 0)
    )
    sigma = sigma[np.isfinite(sigma)]
    return found, (limit + LIKELY) * float(sigma.max()) if len(sigma) else None


def _sample(face: _Face, scatter: float, freedom: float, tilt: float) -> Sample:
    """Return the departures of a wall's faces, whose place and direction along the facade are free."""
    return Sample(
        face.out,
        face.sigma**2 + scatter**2,
        face.along,
        face.up,
        np.zeros(len(face.codes), dtype=np.intp),
        np.column_stack([np.ones(len(face.codes)), face.along - face.along.mean()]),
        tilt * (face.up - face.up.mean()),
        freedom,
    )


def _judged_bulges(face: _Face, sample: Sample, movements: Sequence[Found]) -> list[Found]:
    """Return movements, bulges with what their extent and profile leave open, the others taken out."""
    judged = []
    for movement in movements:
        if movement.shape.name == "local bulge":
            others = sum(
                (o.amount * o.field for o in movements if o is not movement), np.zeros(len(sample.values))
            )
            rest = replace(sample, values=sample.values - others)
            movement = with_extent_and_profile(rest, movement, _STEP * face.size)
        judged.append(movement)
    return judged


def _shapes(face: _Face) -> Iterator[Shape]:
    """Yield the shapes that enough stones can tell from the wall at rest."""
    left, right = float(face.along.min()), float(face.along.max())
    low, high = float(face.up.min()), float(face.up.max())
    long, tall = right - left, high - low
    levels = np.unique(np.round(face.up, 2))
    named: list[tuple[str, tuple[float, ...]]] = []
    if tall > face.size:
        named += [("lean", (low, high)), ("bulge", (low, high))]
        inner = np.linspace(low, high, _GRID + 2)[1:-1]
        named += [("setback", (float(z),)) for z in _between(levels, inner)]
    if long > 2.0 * face.size:
        named.append(("bow", (left, right)))
        inner = np.linspace(left, right, _GRID + 2)[1:-1]
        named += [("offset", (float(s),)) for s in inner]
        for s in inner.tolist():
            # where a wall stands along its facade is not known, so that only its bend is: the shorter side has moved
            named.append(("left end", (left, s)) if s - left < right - s else ("right end", (s, right)))
            if tall > face.size:
                named += [("left corner", (left, s, low, high)), ("right corner", (s, right, low, high))]
        if tall > face.size:
            joints = [left, *inner.tolist(), right]
            named += [
                # it turns about its foot, which lies below the middle of its lowest stones
                ("leaning part", (start, stop, face.bottom, high))
                for i, start in enumerate(joints)
                for stop in joints[i + 1 :]
                if (start, stop) != (left, right) and stop - start > face.size
            ]
    if tall > 2.0 * face.size and long > 2.0 * face.size:
        for radius in (0.25 * min(long, tall), 0.5 * min(long, tall)):
            if radius >= 1.5 * face.size:
                named += [
                    ("local bulge", (float(s), float(z), radius))
                    for s in np.linspace(left, right, _GRID + 2)[1:-1]
                    for z in np.linspace(low, high, _GRID // 2 + 2)[1:-1]
                ]
    for name, places in named:
        shape = Shape(name, places, _RANKS[name])
        moved = np.abs(_field(shape, face)) > 0.1
        if int(moved.sum()) >= _MIN_MOVED_STONES and (
            name in ("lean", "bulge", "bow") or int((~moved).sum()) >= _MIN_MOVED_STONES
        ):
            yield shape


def _between(levels: Array, places: Array) -> Array:
    """Return the middles between levels nearest to some places."""
    if len(levels) < 2:
        return np.zeros(0)
    gaps = (levels[1:] + levels[:-1]) / 2.0
    chosen: Array = np.unique(gaps[np.abs(gaps[:, None] - places).argmin(axis=0)])
    return chosen


def _field(shape: Shape, face: _Face) -> Array:
    """Return the values of a shape at the stones of a wall."""
    s, z, at = face.along, face.up, shape.places
    if shape.name == "lean":
        values = (z - at[0]) / (at[1] - at[0])
    elif shape.name == "bulge":
        values = 1.0 - (2.0 * (z - at[0]) / (at[1] - at[0]) - 1.0) ** 2
    elif shape.name == "bow":
        values = 1.0 - (2.0 * (s - at[0]) / (at[1] - at[0]) - 1.0) ** 2
    elif shape.name == "offset":
        values = (s > at[0]).astype(float)
    elif shape.name == "setback":
        values = (z > at[0]).astype(float)
    elif shape.name == "local bulge":
        values = bulge_profile(at, s, z)
    elif shape.name == "leaning part":
        values = ((s >= at[0]) & (s <= at[1])) * (z - at[2]) / (at[3] - at[2])
    else:
        share = (at[1] - s) if shape.name.startswith("left") else (s - at[0])
        values = np.maximum(share, 0.0) / (at[1] - at[0])
        if shape.name.endswith("corner"):
            values = values * (z - at[2]) / (at[3] - at[2])
    return np.asarray(values, dtype=np.float64)


def _sharpener(face: _Face) -> Callable[[Sample, Found], Found]:
    """Return what moves the places of a shape to where they fit best."""

    def sharpen(sample: Sample, fit: Found) -> Found:
        """Return a fitted shape with its places adjusted to the samples."""
        free = {
            "offset": (0,),
            "setback": (0,),
            "local bulge": (0, 1, 2),
            "left end": (1,),
            "left corner": (1,),
        }
        free |= {"right end": (0,), "right corner": (0,), "leaning part": (0, 1)}
        if fit.shape.name not in free:
            return fit
        best, gain, step = fit.shape, _gain(sample, fit.field), 0.5 * face.size
        for _ in range(_TRIALS):
            tried = [
                best._replace(places=tuple(p + sign * step * (i == k) for i, p in enumerate(best.places)))
                for k in free[best.name]
                for sign in (-1.0, 1.0)
            ]
            scores = [
                (_gain(sample, _field(trial, face)), trial) for trial in tried if _is_sound(trial, face)
            ]
            top = max(scores, key=lambda pair: pair[0], default=(-1.0, best))
            if top[0] > gain:
                gain, best = top
            else:
                step *= 0.5
        return replace(fit, shape=best, field=_field(best, face))

    return sharpen


def _is_sound(shape: Shape, face: _Face) -> bool:
    at = shape.places
    widest = max(float(np.ptp(face.along)), float(np.ptp(face.up)))
    if shape.name == "local bulge":
        inside = face.along.min() <= at[0] <= face.along.max() and face.up.min() <= at[1] <= face.up.max()
        if not (inside and 1.5 * face.size <= at[2] <= widest):
            return False
    if shape.name == "leaning part" and at[1] - at[0] < face.size:
        return False
    if shape.name.split()[0] in ("left", "right") and at[1] - at[0] < face.size:
        return False
    if shape.name.endswith("end") and at[1] - at[0] > 0.5 * float(np.ptp(face.along)):
        return False
    moved = np.abs(_field(shape, face)) > 0.1
    return _MIN_MOVED_STONES <= int(moved.sum()) <= len(moved) - _MIN_MOVED_STONES


def _gain(sample: Sample, values: Array) -> float:
    """Return the reduction of the sum of squares by a shape."""
    root = 1.0 / np.sqrt(sample.variance)
    basis = np.linalg.qr(root[:, None] * sample.nuisance)[0]
    shape = root * values
    shape = shape - basis @ (basis.T @ shape)
    square = float(shape @ shape)
    return float(shape @ (root * sample.values)) ** 2 / square if square > 1e-9 else 0.0


def _told(name: str, zone: str | None, face: _Face, fit: Found) -> FaceMovement:
    at = fit.shape.places
    left, right = float(face.along.min()), float(face.along.max())
    low, high = float(face.up.min()), float(face.up.max())
    if fit.shape.name == "local bulge":
        left, right = max(left, at[0] - at[2]), min(right, at[0] + at[2])
        low, high = max(low, at[1] - at[2]), min(high, at[1] + at[2])
    elif fit.shape.name == "offset":
        left = at[0]
    elif fit.shape.name == "setback":
        low = at[0]
    elif fit.shape.name == "leaning part":
        left, right, low = max(left, at[0]), min(right, at[1]), at[2]
    elif fit.shape.name not in ("lean", "bulge", "bow"):
        left, right = max(left, at[0]), min(right, at[1])
    return FaceMovement(
        name, zone, FaceKind(fit.shape.name), left, right, low, high, fit.amount, fit.sigma, fit.probability
    )


def _departures(face: _Face, sound: NDArray[np.intp], scatter: float) -> tuple[Array, Array, float, float]:
    """Return the departures from the best plane and the best upright plane, and the lean of the former with its σ."""
    weights = np.zeros(len(face.codes))
    weights[sound] = 1.0 / (face.sigma[sound] ** 2 + scatter**2)
    middle = float(face.up.mean())
    columns = np.column_stack([np.ones(len(face.codes)), face.along - face.along.mean(), face.up - middle])
    root = np.sqrt(weights)
    departures = []
    for free in (columns, columns[:, :2]):
        solved = np.linalg.lstsq(root[:, None] * free, root * face.out, rcond=None)[0]
        departures.append((face.out - free @ solved, solved))
    (plane, solved), (plumb, _) = departures
    normal = columns.T @ (weights[:, None] * columns)
    tall = float(np.ptp(face.up)) > 1e-6
    sigma = (
        math.sqrt(float(np.linalg.inv(normal)[2, 2]))
        if tall and np.linalg.matrix_rank(normal) == 3
        else math.nan
    )
    return plane, plumb, math.atan(float(solved[2])), sigma
