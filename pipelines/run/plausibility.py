"""Values and corners that no stone or scene can have, and those that deserve a second look, before it is built."""

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence

import numpy as np

from archmodel.store.stone_record import StoneRecord
from ground.units import GIGA, GRAVITY, KILO
from mechanics.arrays import Array, Ints
from mechanics.scene.scene import Fidelity
from pipelines.scene.file import SceneFile
from pipelines.scene.selection import StoneModel
from survey.conventions import JOINT, LISTED, PARALLEL, TENTH
from survey.quality.corners import SeenFace, misplaced_corners
from survey.records.plausible import DENSITY, FRICTION, LENGTH, POISSON, YOUNG, Doubt, doubt_of
from survey.records.survey import OUTLINE_NOTE

_HEADERS = TENTH  # share of a façade's area whose stones reach through the leaf, as headers do, at least [-]
_THIN = 0.8  # depth over that of the leaf below which a stone leaves a void behind it: backs are hewn to a tenth [-]
_BEHIND = JOINT  # by which a stone must reach farther back to lie behind another: a joint [m]
_SQUARE = math.degrees(PARALLEL)  # angle of faces that belong to one façade [°]
_MANY_STEPS = 1e7  # an hour for the smallest scenes, at 0.3 ms for a step
_ENDLESS_STEPS = GIGA  # days even for a single stone
_LONG_STEP = 0.05  # in which a falling stone moves by its joint's width and more: g h² = 25 mm [s]


def impossible_values(scene: SceneFile, models: Sequence[StoneModel]) -> list[str]:
    """List the sizes and properties that no stone can have; nothing computed from them means anything.

    Parameters
    ----------
    scene : with its laws of contact
    models : its stones
    """
    return [text for text, doubt in _doubts(scene, models) if doubt.impossible]


def unusual_values(scene: SceneFile, models: Sequence[StoneModel]) -> list[str]:
    """List the sizes and properties that a stone can have, but hardly any has; parameters as `impossible_values`."""
    return [text for text, doubt in _doubts(scene, models) if not doubt.impossible]


def corner_warnings(models: Sequence[StoneModel]) -> list[str]:
    """List the measured stones of which a corner seems out of place; outlines have as many as they like."""
    measured = (model for model in models if model.record.provenance == "points")
    corners = misplaced_corners(
        [_seen(stone) for stone in measured if OUTLINE_NOTE not in stone.record.notes]
    )
    texts = [f"stone {corner.code}: {corner.text}; measure its corners again" for corner in corners]
    remaining = len(texts) - LISTED
    return [*texts[:LISTED], *([f"{remaining} more signs of corners out of place"] if remaining > 0 else [])]


def depth_warnings(models: Sequence[StoneModel]) -> list[str]:
    """List the stones of each façade that are thinner than its leaf, with nothing behind them.

    The leaf is as thick as the stones that reach through it: those of the deepest tenth of the façade's area. Fixed
    stones, as a slab of ground, belong to no façade.
    """
    records = [model.record for model in models if model.listed is not Fidelity.FIXED]
    facing = np.array([record.normal for record in records]).reshape(-1, 3)
    upright = np.abs(facing[:, 2]) <= np.sin(np.radians(_SQUARE))
    turn = np.degrees(np.arctan2(facing[:, 1], facing[:, 0]))
    remaining, texts = upright.copy(), list[str]()
    while remaining.any():
        first = float(turn[np.flatnonzero(remaining)[0]])
        here = remaining & (np.abs((turn - first + 180.0) % 360.0 - 180.0) <= _SQUARE)
        remaining &= ~here
        outwards = facing[here].mean(axis=0) * [1.0, 1.0, 0.0]
        texts += _thin(records, np.flatnonzero(here), outwards / np.linalg.norm(outwards))
    return texts


def _thin(records: Sequence[StoneRecord], facade: Ints, outwards: Array) -> list[str]:
    """Return a warning on the stones of a façade (rows of the records) that are thinner than its leaf."""
    axes = np.array([(-outwards[1], outwards[0], 0.0), outwards, (0.0, 0.0, 1.0)]).T
    low, high = (
        np.array([bound(record.solid_vertices @ axes, axis=0) for record in records])
        for bound in (np.min, np.max)
    )
    depth = (high - low)[facade, 1]
    order = np.argsort(-depth, kind="stable")
    area = np.cumsum(np.array([records[row].area for row in facade])[order])
    through = order[int(np.searchsorted(area, _HEADERS * area[-1]))]
    leaf, back = float(depth[through]), float(low[facade[through], 1])
    void = list[tuple[str, float]]()
    for row, deep in zip(facade.tolist(), depth.tolist(), strict=True):
        if deep >= _THIN * leaf or low[row, 1] <= back + _BEHIND:
            continue
        middle = 0.5 * (low[row] + high[row])
        covers = ((low <= middle) & (middle <= high))[:, [0, 2]].all(axis=1)
        if not (covers & (low[:, 1] < low[row, 1] - _BEHIND)).any():
            void.append((records[row].code, deep))
    if not void:
        return []
    named = ", ".join(f"{code} {deep:.2f} m" for code, deep in void[:LISTED])
    more = f" and {len(void) - LISTED} more" if len(void) > LISTED else ""
    count = f"{len(void)} stones are" if len(void) > 1 else "1 stone is"
    return [
        f"{count} thinner than the wall, {leaf:.2f} m, with nothing behind: {named}{more}; the void counts as empty: "
        "propose a core (`moma propose infill`), give their depth, or state why"
    ]


def _doubts(scene: SceneFile, models: Sequence[StoneModel]) -> Iterator[tuple[str, Doubt]]:
    yield from _of_sizes(models)
    yield from _of_steps(scene)
    for material in dict.fromkeys(model.material for model in models):
        for value, of in ((material.density, DENSITY), (material.young, YOUNG), (material.poisson, POISSON)):
            if (doubt := doubt_of(value, of)) is not None:
                yield f"material {material.name}: {doubt.text}", doubt
    document = scene.document
    laws = [("contact",), *(law.entry.path for law in scene.laws)]
    values = [scene.contact.law, *(law.law for law in scene.laws)]
    for path, law in zip(laws, values, strict=True):
        friction = getattr(law, "friction", None)
        if friction is not None and (doubt := doubt_of(friction, FRICTION)) is not None:
            yield f"{document.where(*path)}: {doubt.text}", doubt


def _of_steps(scene: SceneFile) -> Iterator[tuple[str, Doubt]]:
    step, duration = scene.time.step, scene.time.duration
    where = scene.document.where("time", "step")
    if (count := duration / step) >= _MANY_STEPS:
        text = (
            f"{where}: {duration:g} s in steps of {step:g} s are {count:.0e} steps, which takes "
            + ("longer than anyone waits" if count >= _ENDLESS_STEPS else "hours at the least")
            + "; usual steps are 0.5 to 10 ms"
        )
        yield text, Doubt(text, count >= _ENDLESS_STEPS)
    if step > _LONG_STEP:
        text = (
            f"{where}: in a step of {step:g} s a stone falls by {KILO * GRAVITY * step**2:.0f} mm; "
            "usual steps are 0.5 to 10 ms"
        )
        yield text, Doubt(text, False)


def _of_sizes(models: Sequence[StoneModel]) -> Iterator[tuple[str, Doubt]]:
    """Yield one finding for all stones of impossible size, and one for all of unusual size: they share a unit."""
    doubts: dict[bool, list[tuple[str, Doubt]]] = defaultdict(list)
    for model in models:
        if model.listed is Fidelity.FIXED:
            continue  # the ground may be of any size
        size = float(np.ptp(model.record.solid_vertices, axis=0).max())
        if (doubt := doubt_of(size, LENGTH)) is not None:
            doubts[doubt.impossible].append((model.record.code, doubt))
    for members in doubts.values():
        (code, doubt), more = members[0], len(members) - 1
        others = f" (and {more} more stone{'s' if more > 1 else ''})" if more else ""
        yield f"stone {code}{others}: {doubt.text}", doubt


def _seen(model: StoneModel) -> SeenFace:
    record = model.record
    return SeenFace(
        code=record.code,
        kind=record.kind,
        line=record.line,
        normal=record.normal,
        outline=record.outline,
        worn=record.rejected_vertices,
        area=record.area,
        length=record.length,
        height=record.height,
    )
