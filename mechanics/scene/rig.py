"""A test rig about some stones: a base, a beam or a hold at their top, and jaws that push at a stated height.

The pieces are bodies of the scene: nothing else in the engine knows of them. Jaws are driven, without friction, and so
stiff that they yield by 10⁻⁵ of the height. They hold the beam by a thin lug at the height of the push, between edges
where it may turn, between faces where it may not, and let it rise and sink, so that the vertical force on it stays.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Annotated

import numpy as np

from ground.errors import SceneError
from ground.settings import Setting
from mechanics.arrays import Array
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.load import Motion
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import Block, Fidelity, LawRule, Part, Scene
from mechanics.scene.shapes import BOX_FACES, box_corners
from mechanics.stones.materials import Material
from mechanics.stones.polyhedra import mass_properties
from mechanics.stones.settings import check_settings

BASE, BEAM, HOLD, JAWS = "rig base", "rig beam", "rig hold", ("rig jaw 1", "rig jaw 2")
"""Codes of the pieces."""

# of the jaws' edges, and of the lug, over the way from the stones' top to the push [-]
_EDGE, _LUG = 0.01, 0.1
# lug that may not turn, and where its jaws begin, above the beam over the height of the stones [-]
_GUIDE, _CLEAR = 0.5, 0.05
# what jaws yield under the vertical force over the height of the stones, and share of it where they guide [-]
_YIELDS, _STIFFER = 1e-5, 0.1
# weight of the beam over the vertical force [-]
_BEAM = 0.01
# of base and hold beyond the stones, over their height [-]
_BEYOND = 0.2
_UP = np.array([0.0, 0.0, 1.0])

Box = tuple[tuple[float, float, float], tuple[float, float, float]]


class Head(StrEnum):
    """Top of the stones."""

    TURNS = "turns"
    GUIDED = "guided"
    HELD = "held"
    FREE = "free"


@dataclass(frozen=True)
class Rig:
    """Push of a rig, and what it puts on the stones.

    Attributes
    ----------
    direction : (3,) horizontal, of any length
    """

    direction: tuple[float, float, float]
    height: Annotated[float, Setting("Height of the push above the stones' lowest point.", "m", above=0)]
    load: Annotated[
        float, Setting("Vertical force on the stones' top, the beam's weight included.", "N", at_least=0)
    ] = 0.0
    head: Annotated[
        Head,
        Setting(
            "What is on top: turns: a rigid beam that is pushed and may turn; guided: one that may not; held: an edge "
            "against which the top leans, while the stones are pushed; free: nothing."
        ),
    ] = Head.TURNS

    def __post_init__(self) -> None:
        check_settings("rig", self)
        if not np.isfinite(self.direction).all() or not any(self.direction[:2]) or self.direction[2]:
            raise SceneError(
                f"direction = {list(self.direction)}", where="rig", remedy="give a horizontal direction"
            )
        if self.load and not self.has_beam:
            raise SceneError(
                f'a load on a top that is "{self.head}"',
                where="rig",
                remedy="leave load out, or put a beam on",
            )

    @property
    def has_beam(self) -> bool:
        """True where a beam is on top, which is what is pushed."""
        return self.head in (Head.TURNS, Head.GUIDED)

    @property
    def pieces(self) -> tuple[str, ...]:
        """Codes of the pieces that have joints with stones by the scene's own laws."""
        return (BASE, BEAM) if self.has_beam else (BASE,)

    @property
    def axes(self) -> Array:
        """Rows (3, 3): along the push, across it, and up."""
        along = np.array(self.direction) / np.linalg.norm(self.direction)
        return np.array([along, np.cross(_UP, along), _UP])


class _Shop:
    """Maker of pieces from boxes in the axes of a rig.

    Attributes
    ----------
    made : so far
    """

    def __init__(self, axes: Array) -> None:
        self._axes = axes
        self.made: list[Block] = []

    def make(self, code: str, *boxes: Box, density: float | None = None) -> None:
        """Make a piece that fills some boxes; without a density [kg/m³] it is fixed."""
        parts = [Part(box_corners(*box) @ self._axes, BOX_FACES) for box in boxes]
        faces = tuple(
            tuple(k + len(part.vertices) * number for k in face)
            for number, part in enumerate(parts)
            for face in part.faces
        )
        self.made.append(
            Block(
                code,
                np.vstack([part.vertices for part in parts]),
                faces,
                Material("rig", density or 1.0, 1.0, 0.0),
                Fidelity.RIGID if density else Fidelity.FIXED,
                parts=tuple(parts) if len(parts) > 1 else (),
            )
        )


def rigged(scene: Scene, rig: Rig, motion: Motion) -> Scene:
    """Return the scene with the pieces of a rig, whose jaws are driven.

    The scene's rules of laws hold for base and beam where they name their codes (`Rig.pieces`).

    Parameters
    ----------
    scene : stones; those that are fixed stay so, and without any they stand on a base
    motion : of `JAWS`

    Raises
    ------
    SceneError : the push is not where it can act
    """
    shop, corners = _Shop(rig.axes), [block.vertices @ rig.axes.T for block in scene.blocks]
    a, c, bottom = np.min([corner.min(axis=0) for corner in corners], axis=0).tolist()
    b, d, top = np.max([corner.max(axis=0) for corner in corners], axis=0).tolist()
    stones: Box = (a, c, bottom), (b, d, top)
    tall, fall = top - bottom, float(np.linalg.norm(scene.gravity))
    weight = fall * sum(
        block.material.density * mass_properties(block.vertices, block.faces, block.code).volume
        for block in scene.blocks
        if block.fidelity is not Fidelity.FIXED
    )
    forces = scene.loads.forces
    if not any(block.fidelity is Fidelity.FIXED for block in scene.blocks):
        wide = _BEYOND * tall
        shop.make(BASE, ((a - wide, c, bottom - wide), (b + wide, d, bottom)))
    if rig.has_beam:
        mass = _BEAM * max(rig.load, weight) / fall
        width, yields = _put_beam(shop, rig, stones, mass)
        down = History.constant((mass * fall - rig.load) * _UP)
        forces = (*forces, StoneForce(frozenset({BEAM}), down))
    else:
        width, yields = _put_jaw(shop, rig, stones, corners)
    stiffness = max(rig.load, weight) / (yields * tall * width * (d - c))
    codes = frozenset(block.code for block in shop.made)
    driven = codes & {*JAWS, HOLD}
    rule = LawRule(
        driven,
        frozenset(block.code for block in scene.blocks) | (codes - driven),
        ElasticJoint(0.0, stiffness, stiffness),
    )
    return replace(
        scene,
        blocks=(*scene.blocks, *shop.made),
        contact=replace(scene.contact, rules=(*scene.contact.rules, rule)),
        loads=replace(scene.loads, forces=forces, motions=(*scene.loads.motions, motion)),
    )


def _put_beam(shop: _Shop, rig: Rig, stones: Box, mass: float) -> tuple[float, float]:
    """Put a beam [kg] on the stones, its lug between two jaws; return their height [m], and how far they yield."""
    (a, c, bottom), (b, d, top) = stones
    tall, at = top - bottom, bottom + rig.height
    rise = at - top
    if rise <= 0:
        remedy = f'give the height at which the beam is pushed, or head = "{Head.HELD}" or "{Head.FREE}"'
        raise _misplaced(rig, "below", tall, remedy)
    middle, half, under = (a + b) / 2, 0.5 * _LUG * rise, top + rise / 2
    turns = rig.head is Head.TURNS
    beam: Box = (a, c, top), (b, d, under)
    lug: Box = (middle - half, c, under), (middle + half, d, under + (rise if turns else tall * _GUIDE))
    # between edges at the height of the push, or faces that the beam's moment hardly turns
    jaw = (at - _EDGE * rise, at + _EDGE * rise) if turns else (under + tall * _CLEAR, lug[1][2])
    volume = sum(float(np.prod(np.subtract(box[1], box[0]))) for box in (beam, lug))
    shop.make(BEAM, beam, lug, density=mass / volume)
    shop.make(JAWS[0], ((a, c, jaw[0]), (middle - half, d, jaw[1])))
    shop.make(JAWS[1], ((middle + half, c, jaw[0]), (b, d, jaw[1])))
    return jaw[1] - jaw[0], _YIELDS * (1.0 if turns else _STIFFER)


def _put_jaw(shop: _Shop, rig: Rig, stones: Box, corners: Sequence[Array]) -> tuple[float, float]:
    """Put a jaw before the face at the height of the push; return its height [m], and how far it yields."""
    (_, c, bottom), (b, d, top) = stones
    tall, at = top - bottom, bottom + rig.height
    if rig.height > tall:
        raise _misplaced(rig, "above", tall, "push lower, or put a beam on")
    wide, edge = _BEYOND * tall, _EDGE * _LUG * tall
    pushed = [
        corner for corner in corners if corner[:, 2].min() < at + edge and corner[:, 2].max() > at - edge
    ]
    face = min(float(corner[:, 0].min()) for corner in pushed)
    shop.make(JAWS[0], ((face - wide, c, at - edge), (face, d, at + edge)))
    if rig.head is Head.HELD:
        shop.make(HOLD, ((b, c, top - edge), (b + wide, d, top + wide)))
    return 2 * edge, _YIELDS


def _misplaced(rig: Rig, where: str, tall: float, remedy: str) -> SceneError:
    return SceneError(
        f"the push at {rig.height:g} m is {where} the stones' top, {tall:g} m", where="rig", remedy=remedy
    )
