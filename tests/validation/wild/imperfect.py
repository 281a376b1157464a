"""Contacts as surveys leave them: warped, folded, overlapping, gapped, and slivers."""

import numpy as np

from mechanics.scene.shapes import bond, box, semicircular_arch, wall
from tests.validation.wild.scene_list import falls, rests, scene, stands, tilted
from tests.validation.wild.stones import (
    fixed,
    folded_box,
    ground,
    shifted,
    sliced_box,
    stack,
    valley_box,
    warped_sides,
    warped_stack,
)


@stands
def warped_beds_slightly():
    """Four stones 0.4 m wide on warped beds that fit: corners 10 mm off the mean plane of each bed, which is level.

    Both stones share the surface, nowhere steeper than 2 · 0.01/0.4 = 0.05, a fourteenth of μ; the centres of mass
    lie within 10 mm of the axis.
    """
    return scene([ground(), *warped_stack(4, 0.4, 0.3, 0.01)])


@stands
def warped_beds_by_a_tenth():
    """The same with corners 20 mm off, up and down in turn: 0.04 m in all, a tenth of the width; 0.1 steep at most."""
    return scene([ground(), *warped_stack(4, 0.4, 0.3, 0.02, seed=2)])


@stands
def warped_sides_by_a_tenth():
    """Five stones with level beds and sides warped by up to 40 mm on 0.4 m, in triangles, half of them folded inwards.

    Beds touch in full; each centre of mass is within 20 mm of the axis, the edges of the beds 160 mm and more.
    """
    return scene([ground(), *(warped_sides(f"S{k}", 0.3 * k, 0.4, 0.3, 0.04, seed=k) for k in range(5))])


@falls
def warped_column_on_a_slope():
    """Warped stones as a column 0.4 m wide, 1.2 m high, with 0.5 of the weight along x.

    It tips at λ = 0.4/1.2 = 0.333 with true faces; the warp of 0.01 m in plan changes that by 5 %; 0.5 is 50 % more.
    """
    return scene([ground(), *warped_stack(4, 0.4, 0.3, 0.01)], gravity=tilted(0.5))


@stands
def folded_by_microns():
    """Five stones whose tops are pushed in by 5 µm in the middle: not convex; they rest on the rims. No side load."""
    stones = [folded_box(f"S{k}", (-0.2, -0.2, 0.3 * k), (0.2, 0.2, 0.3 * k + 0.3), 5e-6) for k in range(5)]
    return scene([ground(), *stones])


@stands
def parts_of_ten_microns():
    """A stack of four, each in two convex parts of which one is 0.01 mm thick. No side load."""
    stones = [sliced_box(f"S{k}", (-0.2, -0.2, 0.3 * k), (0.2, 0.2, 0.3 * k + 0.3), 1e-5) for k in range(4)]
    return scene([ground(), *stones])


@stands
def valleys_as_slivers():
    """A stack of four with valleys of 0.02 mm along their tops, in three parts, two of them wedges 0.02 mm thick."""
    stones = [valley_box(f"S{k}", (-0.3, -0.2, 0.3 * k), (0.3, 0.2, 0.3 * k + 0.3), 2e-5) for k in range(4)]
    return scene([ground(), *stones])


@falls
def valleys_tilted():
    """The same four, in halves, with 0.55 of the weight along x: 0.6 m wide and 1.2 m high tip at λ = 0.5 (10 %)."""
    stones = [
        valley_box(f"S{k}", (-0.3, -0.2, 0.3 * k), (0.3, 0.2, 0.3 * k + 0.3), 2e-5, slivers=False)
        for k in range(4)
    ]
    return scene([ground(), *stones], gravity=tilted(0.55))


@stands
def sliced_and_tilted():
    """Stones with slices of 0.01 mm, 0.4 m wide and 1.2 m high, at λ = 0.3: they tip at 1/3 (10 %)."""
    stones = [sliced_box(f"S{k}", (-0.2, -0.2, 0.3 * k), (0.2, 0.2, 0.3 * k + 0.3), 1e-5) for k in range(4)]
    return scene([ground(), *stones], gravity=tilted(0.3))


@stands
def overlaps_of_10_microns():
    """Six stones in a stack, each 0.01 mm into the one below. No side load."""
    return scene([ground(), *stack(6, 0.4, 0.25, gap=-1e-5)])


@stands
def overlaps_of_a_millimetre():
    """Six stones in a stack, each 1 mm into the one below. No side load."""
    return scene([ground(), *stack(6, 0.4, 0.25, gap=-1e-3)])


@stands
def overlapping_wall():
    """A wall in running bond whose stones are 0.1 mm longer and higher than their places. Vertical loads only."""
    grown = []
    base, *stones = wall(bond(4, 5), 0.5, 0.25, 0.3)
    for one in stones:
        centre = one.vertices.mean(axis=0)
        corners = one.vertices + 5e-5 * np.sign(one.vertices - centre)
        grown.append(type(one)(one.code, corners, one.faces, one.material))
    return scene([base, *grown])


@rests
def gapped_stack():
    """Five stones, each 1 mm above the one below: they fall by up to 5 mm, and land flat."""
    return scene([ground(), *stack(5, 0.4, 0.25, gap=1e-3)])


@rests
def gapped_wall():
    """A wall in running bond with joints open by 0.5 mm on all sides: the stones settle by up to 2.5 mm.

    Each centre of mass stays over its bearing, as each course bears on the whole length of the one below.
    """
    base, *stones = wall(bond(4, 5), 0.5, 0.25, 0.3)
    shrunk = []
    for one in stones:
        centre = one.vertices.mean(axis=0)
        corners = one.vertices - 2.5e-4 * np.sign(one.vertices - centre)
        shrunk.append(type(one)(one.code, corners, one.faces, one.material))
    return scene([base, *shrunk])


@rests
def gapped_arch():
    """Nine voussoirs, t/r = 0.25, shrunk by 0.05 mm on each joint: more than twice the least thickness, 0.1015.

    It sags by a few joint widths, 0.5 mm in all, 1/500 of the thickness.
    """
    right, left, *stones = semicircular_arch(9, 0.25, 1.0)
    shrunk = []
    for one in stones:
        centre = one.vertices.mean(axis=0)
        corners = centre + (one.vertices - centre) * (1 - 2e-4)
        shrunk.append(type(one)(one.code, corners, one.faces, one.material))
    return scene([right, left, *shrunk])


@stands
def beam_on_slivers():
    """A beam of 1 m that bears on 0.5 mm at each end: a simple beam, W/2 in each bearing."""
    piers = (
        fixed("left", (-0.6, -0.1, 0), (-0.4995, 0.1, 0.5)),
        fixed("right", (0.4995, -0.1, 0), (0.6, 0.1, 0.5)),
    )
    beam = box("beam", (-0.5, -0.1, 0.5), (0.5, 0.1, 0.7))
    return scene([*piers, beam, box("load", (-0.1, -0.1, 0.7), (0.1, 0.1, 0.9))])


@falls
def beam_on_one_sliver():
    """The same beam without the right pier: nothing bears the moment W/2 · 1 m about the sliver."""
    beam = box("beam", (-0.5, -0.1, 0.5), (0.5, 0.1, 0.7))
    return scene([fixed("left", (-0.6, -0.1, 0), (-0.4995, 0.1, 0.5)), beam])


@stands
def sliver_beside_a_bearing():
    """A stone of 0.6 m that bears on 0.35 m of a pier under its centre (0.30 m), and on 0.1 mm of a second one."""
    piers = (
        fixed("wide", (-0.35, -0.2, 0), (0.0, 0.2, 0.5)),
        fixed("touch", (0.2499, -0.2, 0), (0.6, 0.2, 0.5)),
    )
    lower = box("lower", (-0.35, -0.2, 0.5), (0.25, 0.2, 0.8))
    return scene(
        [*piers, lower, shifted(lower, (-0.05, 0, 0.3), "upper"), shifted(lower, (0, 0, 0.6), "top")]
    )


@falls
def sliver_at_the_side():
    """A stone that touches a wall with its head over 0.1 mm, and has nothing beneath: no normal force, no friction."""
    pier = fixed("pier", (-1.0, -0.2, 0), (0.0, 0.2, 0.5001))
    return scene(
        [
            pier,
            box("stone", (0.0, -0.2, 0.5), (0.4, 0.2, 0.8)),
            box("rest", (-0.5, -0.2, 0.5001), (0, 0.2, 0.8)),
        ]
    )
