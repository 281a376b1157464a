"""Derivatives of limit loads from one solution, against central differences of solved programmes."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.limit import WALLS
from mechanics.limit.assembly import Strength, assembly
from mechanics.limit.live_loads import Acceleration
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import ContactSettings, Scene
from mechanics.scene.shapes import semicircular_arch
from pipelines.assess.study.gradient import by_density, by_strength, difference, dual
from pipelines.assess.study.quantities import bound

CLOSE = 1e-5
"""Difference of derivatives over the largest of them [-]."""
STONES = 12
CASES = {name: (case.blocks, case.friction, case.live) for name, case in WALLS.items()}
CASES["arch"] = (lambda: semicircular_arch(45, 0.15, 1.0), 0.7, Acceleration((1.0, 0.0, 0.0)))
QUICK = "arch"


def posed(blocks, friction):
    return assembly(Scene("limit", tuple(blocks), contact=ContactSettings(DryJoint(friction))))


def solved(blocks, friction, live):
    return bound(posed(blocks, friction), live, "limit")


def heavier(blocks, body, share):
    changed = list(blocks)
    material = changed[body].material
    changed[body] = replace(
        changed[body], material=replace(material, density=material.density * np.exp(share))
    )
    return changed


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name == QUICK else pytest.mark.slow) for name in CASES]
)
def test_derivatives_by_density_and_friction_are_those_of_differences(name):
    made, friction, live = CASES[name]
    blocks = list(made())
    at = dual(solved(blocks, friction, live))
    assert at is not None
    on = at.limited.on
    light = at.limited.load if isinstance(live, Acceleration) else np.zeros_like(at.limited.load)
    derivatives, step = by_density(at, light), 1e-4
    # a common factor of all weights changes nothing where the load is a share of them
    if isinstance(live, Acceleration):
        assert abs(derivatives.sum()) < CLOSE * np.abs(derivatives).max()
    picks = np.random.default_rng(0).choice(len(on.free), min(STONES, len(on.free)), replace=False)
    for row in picks:
        ends = [
            solved(heavier(blocks, on.free[row], sign * step), friction, live).value for sign in (1.0, -1.0)
        ]
        difference = (ends[0] - ends[1]) / (2.0 * step)
        assert abs(difference - derivatives[row]) < CLOSE * np.abs(derivatives).max()
    none = np.zeros(len(on.contacts))
    slope = by_strength(at, Strength(none + 1.0, none, none))
    ends = [solved(blocks, friction + sign * step, live).value for sign in (1.0, -1.0)]
    assert abs((ends[0] - ends[1]) / (2.0 * step) - slope) < CLOSE * max(abs(slope), 1.0)


SIZES = (1e-4, 2e-4, 4e-4, 8e-4, 1.6e-3)
"""Halves of differences of λ [m]; of five the median counts, as rounding ends a programme a step earlier or later."""


def reshaped(blocks, body, part, by):
    """Blocks of which one has its outer face moved, tilted, or its hidden one moved: a plane and a depth [m]."""
    block = blocks[body]
    vertices = block.vertices.copy()
    middle, extent = vertices.mean(axis=0), np.ptp(vertices, axis=0)
    front = vertices[:, 1] < middle[1]
    along = {"height": 1.0, "depth": 1.0}
    along |= {
        "tilt 1": (vertices[:, 0] - middle[0]) / extent[0],
        "tilt 2": (vertices[:, 2] - middle[2]) / extent[2],
    }
    vertices[:, 1] += by * np.where(front == (part != "depth"), along[part], 0.0)
    changed = list(blocks)
    changed[body] = replace(block, vertices=vertices)
    return changed


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name == QUICK else pytest.mark.slow) for name in CASES]
)
def test_derivatives_by_planes_and_depths_are_those_of_differences(name):
    made, friction, live = CASES[name]
    blocks = list(made())
    at = dual(solved(blocks, friction, live))
    assert at is not None
    picks = np.random.default_rng(0).choice(
        len(at.limited.on.free), STONES if name != QUICK else 3, replace=False
    )
    derivatives, differences = [], []
    for row in picks:
        for part in ("height", "tilt 1", "tilt 2", "depth"):
            slopes = []
            for size in SIZES:
                ends = [
                    solved(reshaped(blocks, at.limited.on.free[row], part, sign * size), friction, live)
                    for sign in (1.0, -1.0)
                ]
                slopes.append((ends[0].value - ends[1].value) / (2.0 * size))
                if size == SIZES[0]:
                    derivatives.append(difference(at, *((end.on, live) for end in ends), size))
            differences.append(np.median(slopes))
    assert None not in derivatives
    error = np.abs(np.subtract(derivatives, differences)).max() / np.abs(differences).max()
    print(f"{name}: {error:.1e}")
    assert error < CLOSE
