"""Stones with too little beneath them: unsupported, jammed, squeezed, lintel-less."""

from itertools import pairwise

import numpy as np

from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import Fidelity, LawRule
from mechanics.scene.shapes import LIMESTONE, bond, box, prism, wall
from tests.validation.wild.scene_list import G, falls, scene, stands
from tests.validation.wild.stones import fixed, ground, stack


@falls
def stone_in_the_air():
    """A column of four that stands, and a stone beside it, 0.5 m above the ground, that nothing carries."""
    return scene([ground(), *stack(4, 0.4, 0.3), box("air", (1.0, -0.2, 0.5), (1.4, 0.2, 0.8))])


@falls
def stone_at_a_soffit():
    """A stone that touches a fixed soffit from below: contact cannot pull."""
    return scene([fixed("soffit", (-1, -1, 1), (1, 1, 2)), box("stone", (-0.2, -0.2, 0.7), (0.2, 0.2, 1.0))])


@falls
def stone_at_a_face():
    """A stone whose side touches a wall, nothing beneath: no normal force without push, so no friction."""
    wall_ = fixed("wall", (-1, -1, 0), (0, 1, 2))
    return scene([wall_, box("stone", (0.0, -0.2, 1.0), (0.4, 0.2, 1.3))])


@falls
def block_between_walls():
    """A block 0.4 m wide, 0.5 m high, touching two fixed walls, nothing beneath, μ = 0.7.

    Nothing presses the walls together, so no normal force and no friction. It cannot jam by turning either: the line
    between opposite corners is 0.5/0.4 = 1.25 steep, more than μ.
    """
    walls = fixed("left", (-1, -0.5, -3), (-0.2, 0.5, 2)), fixed("right", (0.2, -0.5, -3), (1, 0.5, 2))
    return scene([*walls, box("block", (-0.2, -0.2, 1.0), (0.2, 0.2, 1.5))])


@falls
def block_between_walls_with_play():
    """The same with 0.05 mm of play on each side: it falls freely."""
    walls = (
        fixed("left", (-1, -0.5, -3), (-0.20005, 0.5, 2)),
        fixed("right", (0.20005, -0.5, -3), (1, 0.5, 2)),
    )
    return scene([*walls, box("block", (-0.2, -0.2, 1.0), (0.2, 0.2, 1.5))])


@falls
def two_blocks_between_walls():
    """Two blocks side by side between fixed walls, nothing beneath: as one."""
    walls = fixed("left", (-1, -0.5, -3), (-0.3, 0.5, 2)), fixed("right", (0.3, -0.5, -3), (1, 0.5, 2))
    blocks = box("one", (-0.3, -0.2, 1.0), (0.0, 0.2, 1.6)), box("two", (0.0, -0.2, 1.0), (0.3, 0.2, 1.6))
    return scene([*walls, *blocks])


def _slot(half_angle, upside_down=False):
    """A wedge 0.4 m high and 0.1 m wide at its narrow end in a slot of the same sides [rad]."""
    t = np.tan(half_angle)
    flip = -1.0 if upside_down else 1.0

    def at(z):
        return 0.05 + flip * t * z if not upside_down else 0.05 + t * (0.4 - z)

    low, high = -0.2, 0.6
    wedge = prism("wedge", [(-at(0), 0), (at(0), 0), (at(0.4), 0.4), (-at(0.4), 0.4)], 0.3)
    left = prism(
        "left", [(-1, low), (-at(low), low), (-at(high), high), (-1, high)], 0.5, fidelity=Fidelity.FIXED
    )
    right = prism(
        "right", [(at(low), low), (1, low), (1, high), (at(high), high)], 0.5, fidelity=Fidelity.FIXED
    )
    return left, right, wedge


@stands
def wedge_in_a_slot():
    """A wedge in a V-shaped slot, half angle atan 0.2, μ = 0.3: N = W/(2 sin β) on each side carries it, friction or
    not; and as tan β < μ it does not slip out again. A stone lies on it."""
    left, right, wedge = _slot(np.arctan(0.2))
    return scene([left, right, wedge, box("load", (-0.05, -0.1, 0.4), (0.05, 0.1, 0.5))], 0.3)


@falls
def wedge_in_an_inverted_slot():
    """A wedge in a slot that widens downwards, half angle atan 0.5, μ = 0.4: the normal forces push it down by
    2 N sin β, friction holds at most 2 μ N cos β, less by a fifth."""
    left, right, wedge = _slot(np.arctan(0.5), upside_down=True)
    return scene([left, right, wedge], 0.4)


# A stone held by friction alone between a wall and a stone that is pushed: 2 μ P = 1.2 W.
@stands("squeezed_pair_that_holds", 1.2)
# The same with 2 μ P = 0.8 W.
@falls("squeezed_pair_that_lets_go", 0.8)
def _squeezed(part):
    """A block between a fixed wall and a pusher on a frictionless sill; 2 μ P = part · W."""
    block = box("block", (0.0, -0.15, 0.5), (0.3, 0.15, 0.8))
    weight = 0.3**3 * LIMESTONE.density * G
    push = part * weight / (2 * 0.5)
    pusher = box("pusher", (0.3, -0.15, 0.35), (0.9, 0.15, 0.95))
    sill = fixed("sill", (0.35, -0.5, 0.0), (2.0, 0.5, 0.35))
    law = LawRule(frozenset({"sill"}), frozenset({"pusher"}), DryJoint(0.0))
    force = StoneForce(frozenset({"pusher"}), History(np.array([0.0]), np.array([[-push, 0.0, 0.0]])))
    wall_ = fixed("wall", (-1.0, -0.5, 0.0), (0.0, 0.5, 1.5))
    return scene([wall_, block, pusher, sill], 0.5, rules=(law,), loads=Loads(forces=(force,)))


def opening(
    courses=8, count=5, first=1, rows=4, low=1.0, high=1.75, depth=0.3, length=0.5, height=0.25, halves=False
):
    """A wall in running bond with an opening of `rows` courses above the first, from x = low to high [m], no lintel.

    Stones that reach into the opening end at its jamb.
    """
    kept = []
    for k, course in enumerate(bond(count, courses, halves_first=halves)):
        ends = length * np.concatenate([[0.0], np.cumsum(course)])
        for i in range(len(course)):
            spans = [(ends[i], ends[i + 1])]
            if first <= k < first + rows:
                a, b = spans[0]
                spans = [s for s in ((a, min(b, low)), (max(a, high), b)) if s[1] - s[0] > 1e-9]
            for j, (a, b) in enumerate(spans):
                low_corner, high_corner = (a, -depth / 2, k * height), (b, depth / 2, (k + 1) * height)
                kept.append(box(f"{k + 1}-{i + 1}{'ab'[j]}", low_corner, high_corner))
    wide = length * count
    base = fixed("base", (-1.0, -1.0, -0.5), (wide + 1.0, 1.0, 0.0))
    return base, *kept


@falls
def opening_beside_a_narrow_jamb():
    """39 stones, an opening of 0.75 m and five courses, a jamb of 0.25 m, no lintel.

    The linear program finds no equilibrium at μ = 0.7, nor at 0.6, as here: the jamb cannot bear the thrust.
    """
    return scene(opening(8, 5, 1, 5, 0.25, 1.0), 0.6)


@falls
def opening_under_one_course():
    """41 stones, an opening of 0.75 m and six courses under the last one, no lintel.

    The linear program finds no equilibrium at μ = 0.5; here it is 0.4.
    """
    return scene(opening(8, 5, 1, 6, 0.375, 1.125, halves=True), 0.4)


@falls
def opening_with_open_joints():
    """43 stones, an opening of 0.75 m in whose middle a stone of 0.5 m has nothing beneath; head joints open by 2 mm.

    That stone touches no neighbour, so it falls freely; the course above bears on its neighbours.
    """
    base, *stones = opening(8, 5, 1, 3, 0.875, 1.625)
    open_ = []
    for one in stones:
        corners = one.vertices.copy()
        corners[:, 0] -= 1e-3 * np.sign(corners[:, 0] - corners[:, 0].mean())
        open_.append(type(one)(one.code, corners, one.faces, one.material))
    return scene([base, *open_])


@stands
def opening_with_a_lintel():
    """A wall of three courses on two piers 0.75 m apart, a lintel of 1.25 m with bearings of 0.25 m.

    All loads are vertical and every stone bears on both its neighbours below, by a quarter of its length or more.
    """
    piers = wall([[0.5, 1.0, -1.5, 1.0, 0.5], [1.0, 0.5, -1.5, 0.5, 1.0]] * 2, 0.5, 0.25, 0.3)
    lintel = box("lintel", (0.5, -0.15, 1.0), (1.75, 0.15, 1.25))
    beside = [
        box("left", (0.0, -0.15, 1.0), (0.5, 0.15, 1.25)),
        box("right", (1.75, -0.15, 1.0), (2.25, 0.15, 1.25)),
    ]
    above = [
        box(f"above {k}-{i}", (a, -0.15, 1.25 + 0.25 * k), (b, 0.15, 1.5 + 0.25 * k))
        for k, ends in enumerate(((0.0, 0.75, 1.5, 2.25), (0.0, 0.4, 1.125, 1.85, 2.25)))
        for i, (a, b) in enumerate(pairwise(ends))
    ]
    return scene([*piers, lintel, *beside, *above])
