"""Least friction of the semicircular arch: it stands above, and its stones slide apart below.

Contact points: sharp corners. The limits are those of associative limit analysis; Gilbert, Casapulla & Ahmed 2006
find the same values for Coulomb's friction without dilatancy.
"""

import pytest

from tests.validation.masonry import semicircular_arch
from tests.validation.statics.limit_analysis import stands as can_stand
from tests.validation.statics.verdict import falls, hold, report, stands

COUNT = 27
# (t/R, least μ): a thick arch, in which stones only slide, and one that is barely thick enough for its hinges
LEAST_FRICTION = [(0.2, 0.30899), (0.1075, 0.39444)]
# (μ, least t/R), both slide and hinge
LEAST_THICKNESS = [(0.32, 0.18384), (0.33, 0.17265), (0.35, 0.15118), (0.375, 0.12597), (0.39, 0.11163)]
# (t/R, least μ), the same curve read the other way
MIXED = [(0.11, 0.39175), (0.12, 0.38118), (0.13, 0.37089), (0.15, 0.35114), (0.18, 0.32341)]


@pytest.mark.parametrize(("thickness", "least"), LEAST_FRICTION + MIXED)
def test_limit_analysis_finds_the_least_friction(thickness, least):
    """A03, A04: least μ of 27 voussoirs, to the digits given (own linear program)."""
    arch = semicircular_arch(COUNT, thickness)
    assert can_stand(arch, least + 2e-5)
    assert not can_stand(arch, least - 2e-5)


@pytest.mark.parametrize(("friction", "least"), LEAST_THICKNESS)
def test_limit_analysis_finds_the_least_thickness_with_friction(friction, least):
    """A04: least t/R of 27 voussoirs, to the digits given (own linear program; Gilbert et al. 2006)."""
    assert can_stand(semicircular_arch(COUNT, least + 2e-5), friction)
    assert not can_stand(semicircular_arch(COUNT, least - 2e-5), friction)


def test_a_thick_arch_of_many_voussoirs_needs_about_the_same_friction():
    """A03: μ = 0.309215 for N = 200 (own linear program)."""
    arch = semicircular_arch(200, 0.2)
    assert can_stand(arch, 0.309215 + 1e-5)
    assert not can_stand(arch, 0.309215 - 1e-5)


@pytest.mark.parametrize(("thickness", "least"), LEAST_FRICTION)
def test_the_arch_stands_with_a_little_more_friction(thickness, least):
    """A03: stable at +0.01."""
    result = hold(semicircular_arch(COUNT, thickness), least + 0.01)
    assert stands(result), report(result)


@pytest.mark.parametrize(("thickness", "least"), LEAST_FRICTION)
def test_the_arch_falls_with_a_little_less_friction(thickness, least):
    """A03: collapses at -0.01."""
    result = hold(semicircular_arch(COUNT, thickness), least - 0.01)
    assert falls(result), report(result)


SOME = [pytest.param(*c, marks=() if c[0] == 0.35 else pytest.mark.slow) for c in LEAST_THICKNESS]


@pytest.mark.parametrize(("friction", "least"), SOME)
def test_sliding_and_hinges_together_set_the_least_thickness(friction, least):
    """A04: t/R within 3 %."""
    up, down = (hold(semicircular_arch(COUNT, f * least), friction) for f in (1.03, 0.97))
    assert stands(up), report(up)
    assert falls(down), report(down)


@pytest.mark.slow
@pytest.mark.parametrize(("thickness", "least"), MIXED)
def test_sliding_and_hinges_together_set_the_least_friction(thickness, least):
    """A04: μ within 3 %."""
    arch = semicircular_arch(COUNT, thickness)
    up, down = hold(arch, 1.03 * least), hold(arch, 0.97 * least)
    assert stands(up), report(up)
    assert falls(down), report(down)
