"""Scenes that admit several states, or none: self-stress could hold what nothing holds, or clamp what slides.

The truth of each is that of forces which arise from nothing (docs/theory.md §3), by statics in closed form. Scenes
near a limit lie the stated share off it.
"""

from dataclasses import replace

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import HalfspaceIntersection

from mechanics.scene.scene import Block, Fidelity
from mechanics.scene.shapes import LIMESTONE, box, prism
from tests.validation.masonry import area, overhanging_stack, semicircular_arch
from tests.validation.wild.scene_list import G, Truth, Wild, scene
from tests.validation.wild.stones import fixed, ground, stack

STANDS, FALLS = Truth.STANDS, Truth.FALLS
WEDGE = 33.357
"""Friction angle [°] below which a wedge slides on planes that dip 40° towards 130° and 60° towards 220°: at its limit
it slides along their line of intersection with friction on both, and nothing across it."""


def _plane(dip, towards):
    """Upward normal of a plane [°]; x points east, y north."""
    dip, towards = np.radians([dip, towards])
    return np.array([np.sin(dip) * np.sin(towards), np.sin(dip) * np.cos(towards), np.cos(dip)])


def _polyhedron(code, planes, fidelity=Fidelity.RIGID):
    """The stone behind planes, each an outward normal (3,) and a point (3,)."""
    rows = []
    for normal, point in planes:
        normal = np.asarray(normal, dtype=float) / np.linalg.norm(normal)
        rows.append([*normal, -normal @ np.asarray(point, dtype=float)])
    half = np.array(rows)
    most = linprog(
        [0, 0, 0, -1],
        np.column_stack([half[:, :3], np.ones(len(half))]),
        -half[:, 3],
        bounds=[(None, None)] * 3 + [(0, None)],
    )
    corners = np.unique(np.round(HalfspaceIntersection(half, most.x[:3]).intersections, 12), axis=0)
    faces = []
    for row in half:
        on = np.flatnonzero(np.abs(corners @ row[:3] + row[3]) < 1e-9)
        around = corners[on] - corners[on].mean(axis=0)
        along = around[0] / np.linalg.norm(around[0])
        across = np.cross(row[:3], along)
        order = np.argsort(np.arctan2(around @ across, around @ along))
        faces.append(tuple(int(one) for one in on[order]))
    return Block(code, corners, tuple(faces), LIMESTONE, fidelity)


def least_angle(planes):
    """Friction angle [°] at which a wedge on two planes begins to slide, with friction along their line alone.

    With the normals n, the line a and N₁ n₁ + N₂ n₂ - T a = W: tan φ = T / (N₁ + N₂).
    """
    first, second = (_plane(*one) for one in planes)
    one, other, shear = np.linalg.solve(
        np.column_stack([first, second, -_line(first, second)]), [0.0, 0.0, 1.0]
    )
    return float(np.degrees(np.arctan(shear / (one + other))))


def limit_along_the_line(planes, angle):
    """λ of a horizontal push along the line of two planes at a friction angle [°], and its direction (3,)."""
    first, second = (_plane(*one) for one in planes)
    line = _line(first, second)
    along = line * [1.0, 1.0, 0.0] / np.hypot(*line[:2])
    balance = np.linalg.inv(np.column_stack([first, second, -line]))
    margin = np.array([1.0, 1.0, 0.0]) * np.tan(np.radians(angle)) - [0.0, 0.0, 1.0]
    return float(margin @ balance[:, 2] / (margin @ balance @ along)), along


def _line(first, second):
    """Direction (3,) in which two planes meet, downwards."""
    line = np.cross(first, second)
    return line * -np.sign(line[2]) / np.linalg.norm(line)


FLAT_AND_STEEP = ((35.0, 130.0), (85.0, 225.0))
"""Dip and dip direction [°] of two planes that wedge a stone between them as it is pressed across their line."""


def wedge_on_two_planes(share, tetrahedron=False, law=None, planes=((40.0, 130.0), (60.0, 220.0))):
    """A wedge between two fixed slabs, its friction angle `share` above that of limit equilibrium [-]."""
    first, second = (_plane(*one) for one in planes)
    line, origin = _line(first, second), np.zeros(3)
    sides = [(-first, origin), (-second, origin)]
    if tetrahedron:
        out = np.array([line[0], line[1], 0.0]) / np.hypot(*line[:2])
        ends = [((0, 0, 1), origin), (out + np.array([0, 0, 0.15]), 4 * line)]
    else:
        up = (first + second) / np.linalg.norm(first + second)
        ends = [(up, up), (line, 1.5 * line), (-line, -1.5 * line)]
    slabs = []
    for code, normal, other in (("A", first, second), ("B", second, first)):
        free = np.cross(normal, line)
        free *= np.sign(free @ other)
        limits = [(normal, origin), (-normal, -normal), (line, 8 * line), (-line, -8 * line)]
        slabs.append(_polyhedron(code, [*limits, (-free, origin), (free, 8 * free)], Fidelity.FIXED))
    friction = np.tan(np.radians(least_angle(planes) * (1 + share)))
    return scene([*slabs, _polyhedron("wedge", [*sides, *ends])], friction, duration=1.0, law=law)


def _walls(width, top=1.4, floor=None):
    """Two fixed walls that far apart, from z = -3, and a floor at a level."""
    walls = [
        fixed("left", (-1 - width / 2, -1, -3), (-width / 2, 1, top)),
        fixed("right", (width / 2, -1, -3), (1 + width / 2, 1, top)),
    ]
    return (
        walls
        if floor is None
        else [*walls, fixed("floor", (-width / 2, -1, floor - 1), (width / 2, 1, floor))]
    )


def bar_between_walls(width, height, friction, count=1):
    """Stones side by side that just fill the room between two upright walls, with nothing beneath."""
    at = np.linspace(-width / 2, width / 2, count + 1)
    bars = [box(f"b{k}", (at[k], -0.5, 0), (at[k + 1], 0.5, height)) for k in range(count)]
    return scene([*_walls(width), *bars], friction, duration=1.0)


def plug(half_angle, friction, downwards):
    """A stone of that half angle [°] in a slot of the same sides, which narrows downwards or upwards."""
    lean = np.tan(np.radians(half_angle)) * (1 if downwards else -1)
    low, high, middle = -0.4, 1.0, 0.3

    def half(z):
        return middle + lean * (z - 0.3)

    stone = prism("plug", [(-half(0), 0), (half(0), 0), (half(0.6), 0.6), (-half(0.6), 0.6)], 0.3)
    left = prism(
        "left", [(-2, low), (-half(low), low), (-half(high), high), (-2, high)], 0.5, fidelity=Fidelity.FIXED
    )
    right = prism(
        "right", [(half(low), low), (2, low), (2, high), (half(high), high)], 0.5, fidelity=Fidelity.FIXED
    )
    return scene([left, right, stone], friction, duration=1.0)


def shaft(count, floor):
    """Stones on each other that fill a shaft, with or without a floor."""
    stones = [box(f"s{k}", (-0.25, -0.5, 0.3 * k), (0.25, 0.5, 0.3 * k + 0.3)) for k in range(count)]
    return scene([*_walls(0.5, 3.0, 0.0 if floor else None), *stones], 0.8, duration=1.0)


def tower_with_a_stone(place):
    """A tower of five, and a stone that lies on it, touches its side, or hangs under a slab."""
    tower = stack(5, 0.6, 0.3)
    low = {"on top": (-0.2, -0.2, 1.5), "at its side": (0.3, -0.2, 0.9), "beside a gap": (0.3002, -0.2, 0.9)}[
        place
    ]
    loose = box("loose", low, (low[0] + 0.3, 0.2, low[2] + 0.3))
    return scene([ground(), *tower, loose], 0.7, duration=1.0)


def on_a_slope(share, slides=True):
    """A cube whose friction is `share` above the slope, or a slab on edge whose width is that over what it needs."""
    slope = 0.4
    width, height, friction = (
        (0.5, 0.5, slope * (1 + share)) if slides else (0.5 * slope * (1 + share), 0.5, 1.0)
    )
    stone = box("stone", (-width / 2, -0.3, 0), (width / 2, 0.3, height))
    gravity = G * np.array([np.sin(np.arctan(slope)), 0.0, -np.cos(np.arctan(slope))])
    return scene([ground(), stone], friction, gravity=tuple(gravity), duration=1.0)


def _rod(code, foot, head, thickness=0.12):
    """A rhombic rod from corner to corner in the plane y = 0, so thick that it sags by less than 1 % of its width."""
    foot, head = np.asarray(foot, dtype=float), np.asarray(head, dtype=float)
    along = head - foot
    across = thickness * np.array([-along[1], along[0]]) / np.linalg.norm(along)
    middle = 0.5 * (foot + head)
    return prism(code, [tuple(foot), tuple(middle - across), tuple(head), tuple(middle + across)], 0.4)


def leaning_rod(share):
    """A rod that leans on a wall: tan θ = (1 - μ²)/(2 μ) at the limit, with the same friction above and below."""
    limit = 0.75  # tan θ of μ = 0.5
    angle = np.arctan(limit * (1 + share))
    rod = _rod("rod", (2 * np.cos(angle), 0.0), (0.0, 2 * np.sin(angle)))
    wall = fixed("wall", (-1, -1, -0.5), (0, 1, 3))
    return scene([ground(), wall, rod], 0.5, duration=1.0)


def driven_wedge(share):
    """A wedge between two stones on the ground, which it pushes apart.

    It holds where the least push, that of a wedge about to slip, H = W/2 (cos β - μ sin β)/(sin β + μ cos β), is borne
    by the friction of the stones, μ (G + W/2).
    """
    beta, friction, height, low, raised = np.radians(20.0), 0.3, 0.5, 0.3, 0.05
    least = 0.5 * (np.cos(beta) - friction * np.sin(beta)) / (np.sin(beta) + friction * np.cos(beta))

    def half(z):
        return low + np.tan(beta) * z

    wedge = [(-half(raised), raised), (half(raised), raised), (half(height), height), (-half(height), height)]
    own = area(wedge) * ((1 + share) * least / friction - 0.5)
    end = half(height / 2) + own / height
    right = [(low, 0), (end, 0), (end, height), (half(height), height)]
    left = [(-x, z) for x, z in reversed(right)]
    stones = prism("left", left, 0.4), prism("wedge", wedge, 0.4), prism("right", right, 0.4)
    return scene([ground(), *stones], friction, duration=1.0)


def balanced_slab(share):
    """A slab that overhangs a pier, held down by a stone at its other end, which needs a weight in balance."""
    pier = fixed("pier", (-0.5, -0.3, -1), (0.0, 0.3, 0))
    slab = box("slab", (-0.5, -0.3, 0), (1.5, 0.3, 0.2))
    # about the pier's edge: the slab's moment 2 · 0.2 · 0.5 against the stone's weight at 0.35
    weight = 2.0 * 0.2 * 0.5 / 0.35 * (1 + share)
    stone = box("weight", (-0.5, -0.3, 0.2), (-0.2, 0.3, 0.2 + weight / 0.3))
    return scene([pier, slab, stone], 0.7, duration=1.0)


def hung_hook(friction):
    """An angle that hangs over a wall: its arm lies on the top, its leg along the face; nothing else holds it.

    Its centre lies beyond the edge, so that the leg presses the face with H, which friction of the arm must bear:
    about the lower end of the leg W x = H 0.8, x being the way of the centre from the face, and H ≤ μ W.
    """
    wall = fixed("wall", (-1, -1, -2), (0, 1, 0))
    arm, leg = [(-0.2, 0), (0.3, 0), (0.3, 0.2), (-0.2, 0.2)], [(0, -0.8), (0.3, -0.8), (0.3, 0), (0, 0)]
    outline = [(-0.2, 0), (0, 0), (0, -0.8), (0.3, -0.8), (0.3, 0.2), (-0.2, 0.2)]
    return scene([wall, prism("hook", outline, 0.4, parts=[arm, leg])], friction, duration=1.0)


def hung_stones(count):
    """A fixed soffit with stones that touch it from below, side by side."""
    soffit = fixed("soffit", (-2, -1, 1), (2, 1, 2))
    return scene(
        [soffit, *(box(f"h{k}", (0.4 * k, -0.2, 0.6), (0.4 * k + 0.4, 0.2, 1.0)) for k in range(count))]
    )


def overhang(count, part):
    """A stack with that part of its largest harmonic overhang."""
    return scene([ground(), *overhanging_stack(count, part)], 0.7, duration=1.0)


def arch(count, thickness):
    """A semicircular arch of voussoirs on fixed springers; at least 0.1075 R thick where voussoirs are many."""
    return scene(semicircular_arch(count, thickness), 1.0, duration=1.0)


def _named(name, truth, make, *arguments):
    """An entry of the collection."""
    return Wild(name, truth, lambda: replace(make(*arguments), name=name))


def _either(name, make, margins, *more):
    """Entries on both sides of a limit, by their margins [-]."""
    return [
        _named(f"{name} {100 * margin:+.3g} %", STANDS if margin > 0 else FALLS, make, margin, *more)
        for margin in margins
    ]


_CLOSE = (-0.06, -0.03, -0.012, 0.012, 0.03, 0.06)
_NEAR = (-0.06, -0.025, 0.025, 0.06)
SCENES = {
    entry.name: entry
    for entry in (
        *_either("wedge", wedge_on_two_planes, _CLOSE),
        *_either("tetrahedron", wedge_on_two_planes, _CLOSE, True),
        *(_named(f"bar {w:g}×{h:g}, μ {mu}", FALLS, bar_between_walls, w, h, mu)
          for w, h, mu in ((1.8, 0.8, 0.3), (1.8, 0.8, 0.84), (0.5, 0.5, 0.9), (0.4, 0.6, 0.7), (0.6, 0.6, 2.0))),
        # stones side by side could bear as an arch where μ ≥ 4 h/L, but nothing presses them together before they slide
        *(_named(f"lintel of {n}, {w:g}×{h:g}, μ {mu}", FALLS, bar_between_walls, w, h, mu, n)
          for n, w, h, mu in ((2, 1.2, 0.6, 0.6), (2, 3.0, 0.3, 0.7), (3, 1.2, 0.6, 0.6), (4, 3.2, 0.25, 0.8))),
        *(_named(f"plug {a}°, narrows down, μ {mu}", STANDS, plug, a, mu, True) for a, mu in ((5, 0.5), (20, 0.1))),
        *(_named(f"plug {a}°, narrows up, μ {mu}", FALLS, plug, a, mu, False)
          for a, mu in ((3, 0.7), (10, 0.7), (25, 0.7), (10, 0.1))),
        *(_named(f"shaft of {n}, {'floor' if floor else 'no floor'}", STANDS if floor else FALLS, shaft, n, floor)
          for n, floor in ((1, False), (4, False), (4, True))),
        _named("tower, stone on top", STANDS, tower_with_a_stone, "on top"),
        _named("tower, stone at its side", FALLS, tower_with_a_stone, "at its side"),
        _named("tower, stone beside a gap", FALLS, tower_with_a_stone, "beside a gap"),
        *_either("cube on a slope", on_a_slope, _NEAR),
        *_either("slab on a slope", on_a_slope, _NEAR, False),
        *_either("rod", leaning_rod, _NEAR),
        *_either("driven wedge", driven_wedge, _NEAR),
        *_either("balanced slab", balanced_slab, _NEAR),
        _named("hook, μ 0.6", STANDS, hung_hook, 0.6),
        _named("hook, μ 0.05", FALLS, hung_hook, 0.05),
        *(_named(f"{n} stones at a soffit", FALLS, hung_stones, n) for n in (1, 3)),
        *(_named(f"overhang of {n}, {part:g}", STANDS if part < 1 else FALLS, overhang, n, part)
          for n, part in ((2, 0.96), (2, 1.04), (4, 0.97), (4, 1.03))),
        *(_named(f"arch of {n}, {t:g}", truth, arch, n, t)
          for n, t, truth in ((15, 0.14, STANDS), (15, 0.08, FALLS), (31, 0.125, STANDS), (31, 0.09, FALLS))),
        # friction across the line holds down to 0.96 of the angle of limit equilibrium
        *_either("steep tetrahedron", wedge_on_two_planes, (-0.08, -0.055, 0.012, 0.03), True, None, FLAT_AND_STEEP),
    )
}  # fmt: skip
"""All of them by name."""
