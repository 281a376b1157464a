"""Values and corners that no stone or scene can have, and those that deserve a second look, before it is built."""

from collections import defaultdict
from collections.abc import Iterator, Sequence

import numpy as np

from mechanics.scene.scene import Fidelity
from pipelines.scene.file import SceneFile
from pipelines.scene.selection import StoneModel
from survey.quality.corners import SeenFace, misplaced_corners
from survey.quality.plausible import DENSITY, FRICTION, LENGTH, POISSON, YOUNG, Doubt, doubt_of
from survey.records.survey import OUTLINE_NOTE

__all__ = ["corner_warnings", "impossible_values", "unusual_values"]

_SHOWN = 6  # most findings of one sort that are named
_MANY_STEPS = 1e7  # an hour for the smallest scenes, at 0.3 ms for a step
_ENDLESS_STEPS = 1e9  # days even for a single stone
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
    measured = (one for one in models if one.record.provenance == "points")
    found = misplaced_corners([_seen(one) for one in measured if OUTLINE_NOTE not in one.record.notes])
    texts = [f"stone {one.code}: {one.text}; measure its corners again" for one in found]
    left = len(texts) - _SHOWN
    return [*texts[:_SHOWN], *([f"{left} more signs of corners out of place"] if left > 0 else [])]


def _doubts(scene: SceneFile, models: Sequence[StoneModel]) -> Iterator[tuple[str, Doubt]]:
    yield from _of_sizes(models)
    yield from _of_steps(scene)
    for material in dict.fromkeys(one.material for one in models):
        for value, of in ((material.density, DENSITY), (material.young, YOUNG), (material.poisson, POISSON)):
            if (doubt := doubt_of(value, of)) is not None:
                yield f"material {material.name}: {doubt.text}", doubt
    document = scene.document
    laws = [("contact",), *(one.entry.path for one in scene.laws)]
    values = [scene.contact.law, *(one.law for one in scene.laws)]
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
            f"{where}: in a step of {step:g} s a stone falls by {9.81e3 * step**2:.0f} mm; "
            "usual steps are 0.5 to 10 ms"
        )
        yield text, Doubt(text, False)


def _of_sizes(models: Sequence[StoneModel]) -> Iterator[tuple[str, Doubt]]:
    """Yield one finding for all stones of impossible size, and one for all of unusual size: they share a unit."""
    found: dict[bool, list[tuple[str, Doubt]]] = defaultdict(list)
    for model in models:
        if model.listed is Fidelity.FIXED:
            continue  # the ground may be of any size
        size = float(np.ptp(model.record.solid_vertices, axis=0).max())
        if (doubt := doubt_of(size, LENGTH)) is not None:
            found[doubt.impossible].append((model.record.code, doubt))
    for members in found.values():
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
