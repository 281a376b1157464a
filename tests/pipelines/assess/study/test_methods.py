"""Methods against closed forms, and the coverage of their intervals."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from pipelines.assess.study.estimates import latin_hypercube, monte_carlo
from pipelines.assess.study.inputs.distributions import Distribution
from pipelines.assess.study.methods.counting import controlled, mean_of, probability
from pipelines.assess.study.methods.design_points import design_point, design_points
from pipelines.assess.study.methods.failure import Failure
from pipelines.assess.study.methods.first_order import first_order
from pipelines.assess.study.methods.importance import importance
from pipelines.assess.study.methods.sobol import sobol
from pipelines.assess.study.methods.subset import subset
from pipelines.assess.study.settings import Shape
from pipelines.assess.workers.store import Sample

FAILS = Failure("q", 0.0)
COVERED = 90
"""Of 100 repetitions: a perfect interval of 95 % reaches 90 with a probability of .989."""


class Function:
    """Samples of a function of points, and how many were taken."""

    def __init__(self, function, gradient=None):
        self.function, self.slope, self.taken = function, gradient, 0

    def __call__(self, points, gradient=False):
        self.taken += len(points)
        return [
            Sample(
                point,
                {"q": float(self.function(point))},
                gradient=self.slope(point) if gradient and self.slope else None,
            )
            for point in points
        ]


def least_thickness(sigma, dimension=1):
    """t/R ~ N(.12, σ) less the least thickness of an arch of 21 voussoirs, .10670."""
    slope = np.zeros(dimension)
    slope[0] = sigma
    return Function(lambda u: 0.12 + sigma * u[0] - 0.10670, lambda u: slope)


@pytest.mark.parametrize(("sigma", "exact", "index"), [(0.005, 3.907e-3, 2.660), (0.003, 4.639e-6, 4.433)])
def test_form_and_importance_sampling_of_a_linear_limit_state(sigma, exact, index):
    samples = least_thickness(sigma, 20)
    (design,) = design_points(samples, FAILS, 20)
    assert samples.taken <= 5
    assert design.index == pytest.approx(index, abs=1e-3)
    found = importance(samples, [design], 1000, 1).probability(FAILS, 0.95)
    assert samples.taken <= 1200
    assert found.cov <= 0.10
    assert found.low < exact < found.high


@pytest.mark.parametrize("start", [0.0, -2.0])
def test_two_states_that_must_be_lost_at_once_meet_in_one_design_point(start):
    """Two planes at an angle of 120 degrees, at 2.0 and 2.5: the line in which they meet is at 5.204 from the mean."""
    normals, apart = np.array([[1.0, 0.0], [-0.5, np.sqrt(0.75)]]), np.array([2.0, 2.5])
    both = Function(
        lambda u: (apart - normals @ u).max(), lambda u: -normals[int(np.argmax(apart - normals @ u))]
    )
    corner = np.linalg.solve(normals, apart)
    found = design_point(both, FAILS, np.full(2, start))
    assert found.converged
    assert found.evaluations <= 6
    assert found.point == pytest.approx(corner, abs=1e-6)
    assert found.index == pytest.approx(np.linalg.norm(corner))
    assert found.shares == pytest.approx(corner**2 / (corner @ corner))
    taken = importance(both, [found], 2000, 1).probability(FAILS, 0.95)
    exact = float(multivariate_normal(cov=[[1.0, -0.5], [-0.5, 1.0]]).cdf(-apart))
    assert taken.low < exact < taken.high


@pytest.mark.parametrize("curved", [0.3, 1.0])
def test_a_limit_state_that_curves_towards_the_mean_takes_few_samples(curved):
    """g = 2.5 - u1 + c u2²: shorter steps alone take 21 samples at times, and with c = 1 no 30 of them are enough."""
    bowl = Function(
        lambda u: 2.5 - u[0] + curved * u[1] ** 2, lambda u: np.array([-1.0, 2.0 * curved * u[1]])
    )
    for start in ((0.0, 0.0), (1.0, 2.0), (-2.0, 1.0)):
        found = design_point(bowl, FAILS, np.array(start))
        assert found.converged
        assert found.evaluations <= 12
        assert found.index == pytest.approx(2.5, abs=1e-3)


def test_the_design_point_of_a_mean_that_fails_lies_on_the_way_back():
    bowl = Function(lambda u: u[0] - 1.0 + 0.2 * u[1] ** 2, lambda u: np.array([1.0, 0.4 * u[1]]))
    found = design_point(bowl, FAILS, np.array([2.0, 1.0]))
    assert found.converged
    assert found.index == pytest.approx(-1.0, abs=1e-2)


def test_subset_simulation_reaches_small_probabilities():
    samples = least_thickness(0.003, 5)
    found = subset(samples, FAILS, 5, 1000, 1, 0.95)
    assert found.complete
    assert samples.taken <= 6000
    assert found.probability.low < 4.639e-6 < found.probability.high


def repeated(made):
    """Return how many of 100 repetitions hold."""
    return sum(made(seed) for seed in range(100))


def test_intervals_of_counted_probabilities_cover():
    exact = float(norm.cdf(-1.0))

    def covers(seed):
        found = probability(monte_carlo(60, 1, seed)[:, 0] + 1.0, 0.95)
        return found.low <= exact <= found.high

    assert repeated(covers) >= COVERED


def test_intervals_of_means_and_control_variates_cover_and_are_narrower():
    widths = []

    def covers(seed):
        points = monte_carlo(40, 2, seed)
        values = points[:, 0] + 0.1 * (points[:, 1] ** 2 - 1.0)
        plain, found = mean_of(values, 0.95), controlled(values, points[:, 0], 0.0, 0.95)
        widths.append((found.high - found.low) / (plain.high - plain.low))
        return found.low <= 0.0 <= found.high

    assert repeated(covers) >= COVERED
    assert np.mean(widths) < 0.3


def test_intervals_of_latin_hypercubes_cover():
    exact = float(norm.cdf(-1.5))

    def covers(seed):
        found = probability(latin_hypercube(80, 3, seed).sum(axis=1) / np.sqrt(3.0) + 1.5, 0.95)
        return found.low <= exact <= found.high

    assert repeated(covers) >= COVERED


def test_intervals_of_importance_sampling_cover():
    def covers(seed):
        samples = least_thickness(0.005, 10)
        designs = design_points(samples, FAILS, 10)
        found = importance(samples, designs, 200, seed).probability(FAILS, 0.95)
        return found.low <= 3.907e-3 <= found.high

    assert repeated(covers) >= COVERED


@pytest.mark.slow
@pytest.mark.parametrize("nearer", [-1.0, 1.0])
def test_intervals_of_curves_about_design_points_cover(nearer):
    """The probability at levels a standard deviation off that of the design points, on either side."""
    level = 0.005 * nearer
    exact = float(norm.cdf((0.1067 + level - 0.12) / 0.005))

    def covers(seed):
        samples = least_thickness(0.005, 10)
        taken = importance(samples, design_points(samples, FAILS, 10), 200, seed)
        found = taken.probability(Failure("q", level), 0.95)
        return found.low <= exact <= found.high

    assert repeated(covers) >= COVERED


@pytest.mark.slow
def test_intervals_of_importance_sampling_cover_where_samples_have_no_answer():
    """A twentieth of all points fails to be computed: both bounds contain the truth."""

    def covers(seed):
        samples = least_thickness(0.005, 2)
        designs = design_points(samples, FAILS, 2)
        taken = importance(samples, designs, 200, seed)
        lost = [
            Sample(sample.point, {}, "failed", "forced") if abs(sample.point[1]) > 1.96 else sample
            for sample in taken.samples
        ]
        found = replace(taken, samples=lost).probability(FAILS, 0.95)
        assert found.unknown > 0
        assert found.low_value <= found.high_value
        return found.low <= 3.907e-3 <= found.high

    assert repeated(covers) >= COVERED


@pytest.mark.slow
def test_intervals_of_counted_probabilities_cover_where_samples_have_no_answer():
    exact = float(norm.cdf(-1.0))

    def covers(seed):
        states = monte_carlo(100, 2, seed)
        found = probability(np.where(np.abs(states[:, 1]) > 1.96, np.nan, states[:, 0] + 1.0), 0.95)
        return found.low <= exact <= found.high

    assert repeated(covers) >= COVERED


def test_intervals_of_plain_means_cover():
    def covers(seed):
        found = mean_of(monte_carlo(12, 1, seed)[:, 0], 0.95)
        return found.low <= 0.0 <= found.high

    assert repeated(covers) >= COVERED


def test_intervals_of_subset_simulation_cover():
    exact = float(norm.cdf(-3.0))

    def covers(seed):
        samples = Function(lambda u: 3.0 - u.sum() / 2.0)
        found = subset(samples, FAILS, 4, 300, seed, 0.95).probability
        return found.low <= exact <= found.high

    assert repeated(covers) >= COVERED


@pytest.mark.slow
def test_intervals_of_the_curve_of_subset_simulation_cover():
    """At each level that it passes the probability is Φ(level - 3)."""

    def covers(seed):
        found = subset(Function(lambda u: 3.0 - u.sum() / 2.0), FAILS, 4, 300, seed, 0.95)
        level, at = found.curve[1]
        assert len(found.curve) == len(found.levels) + 1
        return at.low <= float(norm.cdf(level - 3.0)) <= at.high

    assert repeated(covers) >= COVERED


def ishigami(point):
    x = np.pi * (2.0 * norm.cdf(point) - 1.0)
    return np.sin(x[0]) + 7.0 * np.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * np.sin(x[0])


def test_indices_of_ishigami():
    found = sobol(Function(ishigami), "q", 3, [[0], [1], [2]], 4096, 1, 0.95)
    assert found.first == pytest.approx([0.3139, 0.4424, 0.0], abs=0.02)
    assert found.total == pytest.approx([0.5576, 0.4424, 0.2437], abs=0.02)


def test_intervals_of_indices_cover():
    exact, counts = np.array([0.8, 0.2]), np.zeros((2, 2), dtype=int)

    def covers(seed):
        samples = Function(lambda u: 2.0 * u[0] + u[1])
        found = sobol(samples, "q", 2, [[0], [1]], 64, seed, 0.95)
        for number, ends in enumerate((found.first_interval, found.total_interval)):
            counts[number] += (ends[:, 0] <= exact) & (exact <= ends[:, 1])

    for seed in range(100):
        covers(seed)
    assert counts.min() >= COVERED, counts


def test_a_slender_block_is_linear_and_breadth_decides():
    """λ = b/h, b N(.3, .01), h N(3, .02): mean .100004, COV .0340, shares .961 and .039."""

    def limit(u):
        return (0.3 + 0.01 * u[0]) / (3.0 + 0.02 * u[1])

    def slope(u):
        height = 3.0 + 0.02 * u[1]
        return np.array([0.01 / height, -0.02 * limit(u) / height])

    found = first_order(Function(limit, slope), "q", 2)
    assert found.linear
    assert found.mean == pytest.approx(0.1)
    assert found.sigma / found.mean == pytest.approx(0.0340, rel=0.01)
    assert found.shares == pytest.approx([0.961, 0.039], abs=1e-3)
    values = np.array([limit(u) for u in latin_hypercube(2000, 2, 1)])
    assert values.mean() == pytest.approx(0.100004, abs=5e-5)
    assert values.std() / values.mean() == pytest.approx(found.sigma / found.mean, rel=0.01)


def test_both_sides_are_given_where_two_mechanisms_meet():
    """λ = min(μ, d/h) at μ = d/h, with standard deviations of .03 and .02."""
    both = Function(lambda u: 0.36 + min(0.03 * u[0], 0.02 * u[1]), lambda u: np.array([0.015, 0.01, 0.0]))
    found = first_order(both, "q", 3)
    assert [one.along for one in found.sides] == [0, 1]
    assert [(one.below, one.above) for one in found.sides] == [
        (pytest.approx(0.03), pytest.approx(0.0, abs=1e-9)),
        (pytest.approx(0.02), pytest.approx(0.0, abs=1e-9)),
    ]
    # another mechanism 10⁻⁶ above, and one that is out of the way
    nearly = Function(lambda u: 0.36 + min(0.03 * u[0], 1e-6), lambda u: np.array([0.03]))
    assert [one.along for one in first_order(nearly, "q", 1).sides] == [0]
    apart = Function(lambda u: 0.36 + min(0.03 * u[0], 1e-3), lambda u: np.array([0.03]))
    assert first_order(apart, "q", 1).sides == ()


def test_curvature_is_no_second_side():
    curved = Function(lambda u: (1.0 + 0.1 * u[0]) ** 3, lambda u: np.array([0.3]))
    assert first_order(curved, "q", 1).sides == ()


def test_a_control_of_uncertain_mean_widens_the_interval_and_still_covers():
    """The mean of y = x + noise with that of x from 100 further samples: 90 of 100 intervals hold it."""
    covered, wide = 0, []
    for seed in range(100):
        random = np.random.default_rng(seed)
        x = random.standard_normal(40)
        y = x + 0.2 * random.standard_normal(40)
        other = mean_of(random.standard_normal(100), 0.95)
        half = 0.5 * (other.high - other.low)
        found = controlled(y, x, other.value, 0.95, half)
        covered += found.low < 0.0 < found.high
        wide.append((found.high - found.low) / (mean_of(y, 0.95).high - mean_of(y, 0.95).low))
    assert covered >= COVERED
    assert np.mean(wide) < 0.75


def test_first_order_at_a_kink_is_not_linear():
    limit = Function(lambda u: min(0.35 + 0.03 * u[0], 0.36 + 0.02 * u[1]), lambda u: np.array([0.03, 0.0]))
    found = first_order(limit, "q", 2)
    assert not found.linear


@pytest.mark.parametrize("shape", list(Shape))
def test_slopes_of_distributions_are_those_of_their_values(shape):
    made = Distribution(shape, mean=2.0, sigma=0.3, low=1.0, high=3.0, mode=1.4)
    for z in (-2.0, -0.4, 0.0, 1.1, 2.5):
        difference = (made.value(z + 1e-5) - made.value(z - 1e-5)) / 2e-5
        assert made.slope(z) == pytest.approx(difference, rel=1e-5)


def test_four_rectangles_are_narrower_than_a_normal():
    """Supplement 1 to the GUM, 9.2.3: ± 3.88 of the sum of four, against ± 3.92 by propagation."""
    made = Distribution(Shape.UNIFORM, low=-np.sqrt(3.0), high=np.sqrt(3.0))
    points = latin_hypercube(20_000, 4, 1)
    total = (np.sqrt(3.0) * (2.0 * norm.cdf(points) - 1.0)).sum(axis=1)
    assert made.value(points[0, 0]) == pytest.approx(np.sqrt(3.0) * (2.0 * norm.cdf(points[0, 0]) - 1.0))
    assert 0.5 * float(np.ptp(np.quantile(total, [0.025, 0.975]))) == pytest.approx(3.88, abs=0.04)
    assert 1.96 * total.std() == pytest.approx(3.92, abs=0.04)
