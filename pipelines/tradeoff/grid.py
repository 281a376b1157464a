"""Settings that a tradeoff study tries on a scene, chosen by the outputs that the scene requests."""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from ground.units import CENTI, DECI, MILLI
from mechanics.scene.scene import Block, Fidelity, Method, Placement
from mechanics.stones.meshing.elements import Element
from pipelines.scene.file import SceneFile
from pipelines.tuning.overlay import Overlay
from pipelines.tuning.profiles import PROFILES
from survey.conventions import PER_CENT

_MESHES = (1, 2, 3, 4, 6)
_CELLS = {
    Element.TET4: _MESHES,
    Element.HEX8: _MESHES,
    Element.TET10: _MESHES[:-1],
    Element.HEX20: _MESHES[:-1],
}
"""Cells across the typical smallest width of a stone, by element. Hex27 has more nodes than hex20 to the same order."""

_WORDS = {
    "fidelity": "{}",
    "element": "{}",
    "cells": "{:g} cells",
    "points": "{} points",
    "placement": "points by {}",
    "step": "h {:g} s",
    "theta": "θ {:g}",
    "method": "{}",
    "tolerance": "η {:.0e}",
    "motion_error": "motion to {:.0e} m",
}
"""Changes of an overlay in words."""

_RIGID = Overlay(fidelity=Fidelity.RIGID)
_PLAIN = (Overlay(), _RIGID)
_LINEAR = 4.0  # time of linear over quadratic elements of as many unknowns: contacts need more iterations [-]
_LOOSER = 100.0  # factor on tolerances of looser variants [-]
_TIGHTER = 1.0 / _LOOSER  # factor on tolerances of tighter variants [-]
_LOOSEST = PER_CENT  # largest tolerance; beyond it, contacts no longer obey their laws [-]
_MOTION_ERRORS = (CENTI * MILLI, DECI * MILLI, MILLI)  # of the motion of rigid stones [m]
_PROFILE = "profile"  # first word of the names of profiles


@dataclass(frozen=True)
class Variant:
    """One setting of the study.

    Attributes
    ----------
    name : the changes to the scene, in words
    overlay : the same as a value
    unknowns : expected number of velocities, to order settings by their cost
    element, edge : of the finite elements, None without; and their target edge length [m]
    coarseness : expected error of their stress up to a factor: a power of the distance of nodes over the typical
        smallest width of the stones; infinite without finite elements [-]
    step, tolerance, points : of the run, changed or not [s], [-], [-]
    varied : the setting from which this variant differs in one further thing; None for models of the stones
    effort : expected time over that of `varied`; for models, over that of rigid stones or quadratic elements with as
        many unknowns [-]
    """

    name: str
    overlay: Overlay
    unknowns: float
    element: Element | None
    edge: float
    coarseness: float
    step: float
    tolerance: float
    points: int
    varied: str | None = None
    effort: float = 1.0


def grid(
    scene: SceneFile, blocks: Sequence[Block], width: float, stress: bool = False
) -> tuple[Variant, ...]:
    """Return the settings to try: models of the stones, cheapest first, then variants in one further setting.

    Parameters
    ----------
    scene : as its author wrote it
    blocks : of the scene as written
    width : typical smallest width of the stones, to which cells refer [m]
    stress : the study is about a stress, so that stones must deform

    Where a stone deforms, or has to, it is tried rigid and with finite elements of several kinds and sizes, hexahedra
    only if they suit the stones. Of rigid stones, other contact points are tried; of all, other tolerances and methods
    of the solver. Time steps, and the error of the motion that the solver may leave, are varied where motion is
    followed, not where equilibrium is sought by relaxation.
    """
    moving = [block for block in blocks if block.fidelity is not Fidelity.FIXED]
    models = _models(scene, moving, width, stress)
    settings = [
        *models,
        *chain(*(_of_solver(scene, model) for model in models if not model.name.startswith(_PROFILE))),
        *chain(*(_of_time(scene, model) for model in models)),
        *chain(
            *(
                _of_points(scene, model)
                for model in models
                if model.element is None and model.overlay in _PLAIN
            )
        ),
    ]
    return tuple({setting.name: setting for setting in reversed(settings)}.values())[::-1]


def setting_name(overlay: Overlay) -> str:
    """Return the changes of an overlay in words.

    >>> setting_name(Overlay(element=Element.TET10, cells=2.0, tolerance=1e-4))
    'tet10, 2 cells, η 1e-04'
    """
    values = ((text, getattr(overlay, name)) for name, text in _WORDS.items())
    words = ", ".join(text.format(value) for text, value in values if value is not None)
    return re.sub(r"(?<![.\d])1 cells", "1 cell", words) or "as written"


def _models(scene: SceneFile, moving: Sequence[Block], width: float, stress: bool) -> list[Variant]:
    """Return the models of the stones, by increasing cost."""
    soft = [block for block in moving if block.fidelity is Fidelity.DEFORMABLE]
    models = [_model(scene, Overlay(), moving, soft, width)]
    if soft and not scene.bodies.deformable:
        models.append(_model(scene, _RIGID, moving, (), width))
    all_soft = Overlay(fidelity=Fidelity.DEFORMABLE)
    if stress and not soft:
        plain, soft = all_soft, list(moving)
    else:
        plain = Overlay()
        if 0 < len(soft) < len(moving):
            models.append(_model(scene, all_soft, moving, moving, width))
    for element, counts in _CELLS.items() if soft else ():
        if element.is_tetrahedron or all(map(_suits_hexahedra, soft)):
            meshes = [replace(plain, element=element, cells=float(cells)) for cells in counts]
            models += [_model(scene, mesh, moving, soft, width) for mesh in meshes]
    models += _profiles(scene, moving, () if plain is all_soft else soft, width)
    return sorted(models, key=lambda model: model.effort * model.unknowns)


def _profiles(
    scene: SceneFile, moving: Sequence[Block], soft: Sequence[Block], width: float
) -> Iterator[Variant]:
    """Yield the named profiles; where no stone deforms, without those in which all do."""
    for profile in PROFILES.values():
        overlay = profile.overlay(scene.time)
        if overlay.fidelity is Fidelity.DEFORMABLE and not soft:
            continue  # the scene requests no stress
        deformed = {None: soft, Fidelity.RIGID: (), Fidelity.DEFORMABLE: moving}[overlay.fidelity]
        yield replace(_model(scene, overlay, moving, deformed, width), name=f"{_PROFILE} {profile.name}")


def _of_solver(scene: SceneFile, model: Variant) -> Iterator[Variant]:
    """Yield other tolerances, and other methods for the scene as written and for rigid stones."""
    plain, solver = model.overlay in _PLAIN, scene.solver
    for factor, effort in ((_LOOSER, 1.0), (_TIGHTER, 2.0)) if plain else ((_LOOSER, 1.0),):
        overlay = replace(
            model.overlay,
            tolerance=_other(solver.tolerance, factor),
            velocity_tolerance=_other(solver.velocity_tolerance, factor),
        )
        yield _variant(model, overlay, effort)
    for method in Method if plain else ():
        suits = model.element is None or method is not Method.ADMM
        if suits and method is not solver.method:
            yield _variant(model, replace(model.overlay, method=method), 2.0)


def _of_time(scene: SceneFile, model: Variant) -> Iterator[Variant]:
    """Yield other time steps, errors of the motion and damping of the scheme, where motion is followed."""
    time = scene.time
    if model.overlay not in _PLAIN or time.relaxation:
        return
    for factor in (4.0, 2.0, 0.5, 0.25):
        if factor * time.step <= time.duration:
            yield _variant(model, replace(model.overlay, step=factor * time.step), 1.0 / factor)
    for error in _MOTION_ERRORS if model.element is None else ():
        yield _variant(model, replace(model.overlay, motion_error=error), 0.5)
    for theta in () if time.stop_at_equilibrium else (0.5, 0.6, 1.0):
        if theta != time.theta:
            yield _variant(model, replace(model.overlay, theta=theta), 1.0)


def _of_points(scene: SceneFile, model: Variant) -> Iterator[Variant]:
    """Yield other contact points of flat faces, for rigid stones."""
    for points in (3, 4, 8):
        if points != scene.contact.points:
            yield _variant(model, replace(model.overlay, points=points), points / scene.contact.points)
    for placement in Placement:
        spaced = placement is not Placement.AREA or scene.contact.spacing is not None
        if placement is not scene.contact.placement and spaced:
            yield _variant(model, replace(model.overlay, placement=placement), 1.0)


def _other(tolerance: float, factor: float) -> float:
    return min(factor * tolerance, max(_LOOSEST, tolerance))


def _model(
    scene: SceneFile, overlay: Overlay, moving: Sequence[Block], soft: Sequence[Block], width: float
) -> Variant:
    """Return a setting in which the stones `soft`, of those that move, have finite elements."""
    element = overlay.element or scene.mesh.element
    edge = scene.mesh.size if overlay.cells is None else width / overlay.cells
    return Variant(
        name=setting_name(overlay),
        overlay=overlay,
        unknowns=6.0 * (len(moving) - len(soft)) + sum(_unknowns(one, element, edge) for one in soft),
        element=element if soft else None,
        edge=edge,
        coarseness=(edge / width / element.order) ** element.order if soft else math.inf,
        step=overlay.step or scene.time.step,
        tolerance=overlay.tolerance or scene.solver.tolerance,
        points=overlay.points or scene.contact.points,
        effort=_LINEAR if soft and element.order == 1 else 1.0,
    )


def _variant(model: Variant, overlay: Overlay, effort: float) -> Variant:
    return replace(
        model,
        name=setting_name(overlay),
        overlay=overlay,
        step=overlay.step or model.step,
        tolerance=overlay.tolerance or model.tolerance,
        points=overlay.points or model.points,
        varied=model.name,
        effort=effort,
    )


def _unknowns(block: Block, element: Element, edge: float) -> float:
    """Estimate the number of nodal velocities of a block, as of a box filled with a grid."""
    cells = np.maximum(1.0, np.round(np.ptp(block.vertices, axis=0) / edge))
    corners = float(np.prod(cells + 1.0))
    if element is Element.HEX20:
        corners += float(sum(cells[axis] * np.prod(np.delete(cells + 1.0, axis)) for axis in range(3)))
    elif element.order == 2:
        corners = float(np.prod(2.0 * cells + 1.0))
    return 3.0 * corners


def _suits_hexahedra(block: Block) -> bool:
    """Return whether a block is convex and each of its corners joins three faces."""
    joined = np.bincount(
        np.concatenate([np.array(face) for face in block.faces]), minlength=len(block.vertices)
    )
    return not block.parts and block.radius is None and bool((joined == 3).all())
