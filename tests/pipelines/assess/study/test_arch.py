"""An arch of 21 radial voussoirs falls where t/R is less than .10670: by its geometric factor of safety."""

import numpy as np
import pytest

from mechanics.limit.assembly import assembly
from mechanics.limit.thickness import geometric_safety
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import ContactSettings, Scene
from mechanics.scene.shapes import semicircular_arch
from pipelines.assess.study.methods.design_points import design_points
from pipelines.assess.study.methods.failure import Failure
from pipelines.assess.workers.store import Sample

MEAN, WIDE, SIDE = 0.12, 2.0, 0.002


def factor(thickness):
    blocks = semicircular_arch(21, thickness, 1.0)
    scene = Scene("arch", tuple(blocks), contact=ContactSettings(DryJoint(0.9)))
    return geometric_safety(assembly(scene), WIDE).factor


class Thickness:
    """Samples of t/R ~ N(.12, σ), with a gradient by differences."""

    def __init__(self, sigma):
        self.sigma, self.taken = sigma, 0

    def __call__(self, points, gradient=False):
        self.taken += len(points)
        found = []
        for point in points:
            t = MEAN + self.sigma * point[0]
            slope = (factor(t + SIDE) - factor(t - SIDE)) / (2.0 * SIDE) * self.sigma
            found.append(Sample(point, {"factor": factor(t)}, gradient=np.array([slope])))
        return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sigma", "probability", "index"), [(0.005, 3.907e-3, 2.660), (0.003, 4.639e-6, 4.433)]
)
def test_the_design_point_is_the_least_thickness(sigma, probability, index):
    samples = Thickness(sigma)
    (design,) = design_points(samples, Failure("factor", 1.0), 1)
    assert samples.taken <= 5
    assert design.index == pytest.approx(index, abs=0.005)
    # the factor is known to 10⁻⁴, and so β to 2·10⁻³: P to a hundredth
    assert design.probability == pytest.approx(probability, rel=0.02)


def test_joints_of_an_arch_that_falls_are_widened_until_it_would_stand():
    assert factor(0.1) == pytest.approx(0.1 / 0.1067, abs=2e-3)
    assert np.isnan(geometric_safety(_thin()).factor)


def _thin():
    blocks = semicircular_arch(21, 0.1, 1.0)
    return assembly(Scene("arch", tuple(blocks), contact=ContactSettings(DryJoint(0.9))))
