"""Doubts about outlines: overlaps, odd sizes, masks that leak, faces that something covers."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ground.errors import UsageError
from ground.statistics.scale import deviation
from survey.arrays import Array, Ints
from survey.clouds.extras import optional
from survey.clouds.outlines.outline import Outline
from survey.clouds.outlines.reading import PICTURES, Drawing
from survey.clouds.placing import PlacedOutline
from survey.conventions import ALIKE, FEW, GROUP, LARGELY, MOST, NEARLY, SAMPLE, SOME, STEP, WIDEST_JOINT
from survey.geometry.polygons import ring_area, seamless
from survey.records.review import Doubtful

_OVERLAP = FEW  # part of the smaller stone's area that two outlines may share: jitter of neighbours
_WITHIN = MOST  # of an outline's area in a larger one, above which it lies within this
_FRAMED = GROUP  # outlines that a frame holds at least
_THICK = STEP  # by which boxes of outlines are widened: neighbours do not lie in one plane [m]
_SOLID = NEARLY  # area over that of the convex hull below which an outline leaks: a stone with a deep notch has more
_ODD = 4.5  # robust standard deviations of the logarithm of the area beyond which a size is odd
_SPREAD = SOME  # least standard deviation of that logarithm, since stones of one course differ by more
_MIN_OUTLINES = SAMPLE  # outlines from which sizes have a usual range
_UNSURE = MOST  # score below which a program is not sure of a mask
_FEW_POINTS = 100  # points of a stone that is hardly measured
_COVERED = LARGELY  # share of clear patches below which something covers a stone, or its mask leaks
_TURNED = ALIKE  # angle of a face from the plane of its outline [rad]


def drawn_doubts(placed: Sequence[PlacedOutline], drawing: Drawing) -> list[Doubtful]:
    """List what is odd about outlines in themselves.

    Parameters
    ----------
    placed : outlines in their planes
    drawing : the file that they come from
    """
    outlines = [one.outline for one in placed]
    doubts = list(_shape_doubts(outlines, [one.ring for one in placed], drawing))
    if drawing.path.suffix.lower() not in PICTURES:
        doubts += _overlaps_in_space(placed)
    return doubts


def flat_doubts(outlines: Sequence[Outline], rings: Sequence[Array], drawing: Drawing) -> Iterator[Doubtful]:
    """Yield what is odd about outlines in one plane, whose rings (n, 2) are given in metres."""
    yield from _shape_doubts(outlines, rings, drawing)
    if drawing.path.suffix.lower() in PICTURES:
        return  # a pixel is of one stone
    low, high = (np.array([end(ring, axis=0) for ring in rings]) for end in (np.min, np.max))
    pairs = _near_pairs(low, high)
    yield from _seams(outlines, rings, low, high)
    try:
        yield from _overlaps(outlines, pairs, [rings[i] for i, _ in pairs], [rings[j] for _, j in pairs])
    except UsageError as error:  # shapely is missing, which the reader of these outlines does without
        yield Doubtful("", "overlap", f"not looked for: {error}", str(drawing.path))


def _shape_doubts(
    outlines: Sequence[Outline], rings: Sequence[Array], drawing: Drawing
) -> Iterator[Doubtful]:
    """Yield what is odd about the shape and size of outlines, whose rings (n, 2) are given in metres."""
    if drawing.specks:
        area = "" if drawing.pixel is None else f", {1e4 * drawing.smallest * drawing.pixel**2:.2g} cm²"
        text = f"{drawing.specks} pieces are too small for a stone (under {drawing.smallest} pixels{area}) and left out"
        yield Doubtful("", "specks", text, str(drawing.path))
    for reason, text in drawing.left:
        yield Doubtful("", reason, text, str(drawing.path))
    areas = np.array([abs(ring_area(ring)) for ring in rings])
    logs = np.log(np.maximum(areas, 1e-12))
    middle = float(np.median(logs))
    spread = max(deviation(logs, middle), _SPREAD)
    for outline, ring, area, log in zip(outlines, rings, areas, logs, strict=True):
        for reason, text in outline.doubts:
            yield Doubtful(outline.code, reason, text, outline.where)
        if outline.said.score is not None and outline.said.score < _UNSURE:
            yield Doubtful(outline.code, "low score", f"a score of {outline.said.score:g}", outline.where)
        if _crosses_itself(ring):
            text = "its sides cross each other: its corners are put in order around it where one order is possible"
            yield Doubtful(outline.code, "crosses itself", text, outline.where)
            continue
        if len(outlines) >= _MIN_OUTLINES and abs(log - middle) > _ODD * spread:
            text = f"{area:.3g} m², the usual outline has {np.exp(middle):.3g} m²"
            yield Doubtful(outline.code, "odd size", text, outline.where)
        if (solid := area / max(_hull_area(ring), 1e-12)) < _SOLID:
            text = f"it fills {solid:.0%} of its convex hull: a mask may leak into a joint or a neighbour"
            yield Doubtful(outline.code, "leak", text, outline.where)


def _seams(
    outlines: Sequence[Outline], rings: Sequence[Array], low: Array, high: Array
) -> Iterator[Doubtful]:
    """Yield pairs of outlines without a joint between them, where others have one."""
    upright = [ring if ring_area(ring) > 0.0 else ring[::-1] for ring in rings]
    near = _near_pairs(low - 0.5 * WIDEST_JOINT, high + 0.5 * WIDEST_JOINT)
    for pair in seamless(upright, [(int(i), int(j)) for i, j in near]):
        second = outlines[pair.second]
        text = (
            f"no joint parts it from {second.code} ({pair.gap * 1e3:.0f} mm; others are {pair.usual * 1e3:.0f} mm "
            "wide): one stone drawn as two?"
        )
        yield Doubtful(outlines[pair.first].code, "no joint", text, outlines[pair.first].where)


def measured_doubts(outline: PlacedOutline, plane: Array, numbers: Array) -> Iterator[Doubtful]:
    """Yield what is odd about the points of a stone.

    Parameters
    ----------
    outline : its outline
    plane : (3,) slopes and height of its face in the frame of the outline
    numbers : as `fit_patches` returns them
    """
    code, where = outline.outline.code, outline.outline.where
    clear, count = numbers[2:4].tolist()
    if count < _FEW_POINTS:
        yield Doubtful(code, "few points", f"{int(count)} points", where)
    if clear < _COVERED:
        text = f"{clear:.0%} of its patches are clear: something covers it, or its mask reaches beyond it"
        yield Doubtful(code, "covered", text, where)
    if (turned := float(np.arctan(np.hypot(*plane[:2])))) > _TURNED:
        text = f"its face is turned {np.degrees(turned):.0f}° from the plane of its outline"
        yield Doubtful(code, "turned", text, where)


def _overlaps_in_space(placed: Sequence[PlacedOutline]) -> Iterator[Doubtful]:
    """Yield pairs of outlines that share much of their area, seen along the line of sight of the first."""
    corners = [one.corners for one in placed]
    low = np.array([corner.min(axis=0) for corner in corners]) - _THICK
    high = np.array([corner.max(axis=0) for corner in corners]) + _THICK
    pairs = _near_pairs(low, high)
    pairs = pairs[[abs(float(placed[i].axes[2] @ placed[j].axes[2])) > 0.5 for i, j in pairs]]
    second = [((corners[j] - placed[i].origin) @ placed[i].axes[:2].T) for i, j in pairs]
    yield from _overlaps([one.outline for one in placed], pairs, [placed[i].ring for i, _ in pairs], second)


def _overlaps(
    outlines: Sequence[Outline], pairs: Ints, first: Sequence[Array], second: Sequence[Array]
) -> Iterator[Doubtful]:
    """Yield the pairs (m, 2) of outlines that share much of their area, and those that hold all others.

    Parameters
    ----------
    outlines : all of them
    pairs : whose boxes overlap
    first, second : (n, 2) ring of either outline of each pair, in the same plane [m]
    """
    if not len(pairs):
        return
    shapely = optional("shapely", "overlaps of outlines")
    first_polygons, second_polygons = _polygons(shapely, first), _polygons(shapely, second)
    shared, areas = (
        shapely.area(shapely.intersection(first_polygons, second_polygons)),
        (shapely.area(first_polygons), shapely.area(second_polygons)),
    )
    smaller = np.minimum(*areas)
    within = shared > _WITHIN * smaller
    larger = np.where(areas[0] > areas[1], pairs[:, 0], pairs[:, 1])
    holding = np.bincount(larger[within], minlength=len(outlines))
    frames = np.flatnonzero((holding == len(outlines) - 1) & (holding >= _FRAMED))
    for k in frames.tolist():
        text = f"it holds all {holding[k]} others: it is the wall's edge rather than a stone, leave it out"
        yield Doubtful(outlines[k].code, "overlap", text, outlines[k].where)
    for pair in np.flatnonzero((shared > _OVERLAP * smaller) & ~np.isin(pairs, frames).any(axis=1)):
        a, b = (outlines[i] for i in pairs[pair].tolist())
        part = shared[pair] / max(smaller[pair], 1e-12)
        text = f"it shares {shared[pair]:.2g} m² with {b.code}, {part:.0%} of the smaller"
        yield Doubtful(a.code, "overlap", text, a.where)


def _near_pairs(low: Array, high: Array) -> Ints:
    """Return the pairs (m, 2) of boxes that overlap, the smaller number first."""
    order = np.argsort(low[:, 0], kind="stable")
    ends = np.searchsorted(low[order, 0], high[order, 0])
    found = [np.empty((0, 2), dtype=np.int64)]
    for place, k in enumerate(order):
        others = order[place + 1 : ends[place]]
        close = others[((low[others] <= high[k]) & (high[others] >= low[k])).all(axis=1)]
        if len(close):
            found.append(np.sort(np.column_stack([np.full(len(close), k), close]), axis=1))
    pairs = np.concatenate(found)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def _polygons(shapely: Any, rings: Sequence[Array]) -> Any:
    """Make valid polygons of many rings (n, 2) at once."""
    which = np.repeat(np.arange(len(rings)), [len(ring) for ring in rings])
    return shapely.make_valid(shapely.polygons(shapely.linearrings(np.concatenate(rings), indices=which)))


def _crosses_itself(ring: Array) -> bool:
    """Return whether two sides of a ring (n, 2) cross each other within both of them."""
    starts, ends = ring, np.roll(ring, -1, axis=0)

    def side(places: Array) -> Array:
        """Return on which side of each line (rows) places (columns) lie."""
        along, to = ends - starts, places[None] - starts[:, None]
        return np.asarray(np.sign(along[:, None, 0] * to[:, :, 1] - along[:, None, 1] * to[:, :, 0]))

    apart = side(starts) * side(ends) < 0.0
    return bool((apart & apart.T).any())


def _hull_area(ring: Array) -> float:
    """Return the area of the convex hull of a polygon by Andrew's chain."""
    points = ring[np.lexsort((ring[:, 1], ring[:, 0]))].tolist()
    hull: list[list[float]] = []
    for way in (points, points[::-1]):
        chain: list[list[float]] = []
        for x, y in way:
            while len(chain) >= 2:
                (ax, ay), (bx, by) = chain[-2:]
                if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0:
                    break
                chain.pop()
            chain.append([x, y])
        hull += chain[:-1]
    return abs(ring_area(np.array(hull))) if len(hull) >= 3 else 0.0
