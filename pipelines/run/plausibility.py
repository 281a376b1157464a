"""Values and corners that no stone can have, and those that deserve a second look, before a scene is built of them."""

from collections import defaultdict
from collections.abc import Iterator, Sequence

import numpy as np

from mechanics.scene.scene import Fidelity
from pipelines.scene.file import SceneFile
from pipelines.scene.selection import StoneModel
from survey.quality.corners import SeenFace, misplaced_corners
from survey.quality.plausible import DENSITY, FRICTION, LENGTH, POISSON, YOUNG, Doubt, doubt_of

__all__ = ["corner_warnings", "impossible_values", "unusual_values"]

_SHOWN = 6  # most findings of one sort that are named


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
    """List the measured stones of which a corner seems out of place."""
    found = misplaced_corners([_seen(one) for one in models if one.record.provenance == "points"])
    texts = [f"stone {one.code}: {one.text}; measure its corners again" for one in found]
    left = len(texts) - _SHOWN
    return [*texts[:_SHOWN], *([f"{left} more signs of corners out of place"] if left > 0 else [])]


def _doubts(scene: SceneFile, models: Sequence[StoneModel]) -> Iterator[tuple[str, Doubt]]:
    yield from _of_sizes(models)
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
