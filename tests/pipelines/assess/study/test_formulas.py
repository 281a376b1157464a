"""Parts of the methods by hand: tangents, starts, variances of chains, weights, exact intervals, moments."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import binom, lognorm, norm, triang, uniform

from pipelines.assess.study import actions, gradient, problem, summary
from pipelines.assess.study.inputs.distributions import Distribution
from pipelines.assess.study.inputs.unknowns import Unknown, Unknowns
from pipelines.assess.study.methods import design_points as points
from pipelines.assess.study.methods import importance, subset
from pipelines.assess.study.methods.counting import controlled, fragility, mean_of, probability, quantiles
from pipelines.assess.study.methods.design_points import design_point, design_points
from pipelines.assess.study.methods.first_order import first_order, regressed
from pipelines.assess.study.methods.importance import Weighted
from pipelines.assess.study.methods.sobol import sobol
from pipelines.assess.study.settings import Acts, Shape
from pipelines.assess.workers.store import Sample
from tests.pipelines.assess.study.test_methods import FAILS, Function


@pytest.mark.parametrize(
    ("made", "known"),
    [
        (Distribution(Shape.NORMAL, 2.0, 0.3), norm(2.0, 0.3)),
        # mean and standard deviation are those of the value, not of its logarithm
        (
            Distribution(Shape.LOGNORMAL, 2.0, 0.5),
            lognorm(np.sqrt(np.log(1.0625)), scale=2.0 / np.sqrt(1.0625)),
        ),
        (Distribution(Shape.UNIFORM, low=1.0, high=3.0), uniform(1.0, 2.0)),
        (Distribution(Shape.TRIANGULAR, low=1.0, high=3.0, mode=1.4), triang(0.2, 1.0, 2.0)),
        (Distribution(Shape.TRIANGULAR, low=1.0, high=3.0, mode=1.0), triang(0.0, 1.0, 2.0)),
        (Distribution(Shape.TRIANGULAR, low=1.0, high=3.0, mode=3.0), triang(1.0, 1.0, 2.0)),
    ],
    ids=lambda one: str(getattr(one, "shape", "")),
)
def test_values_are_the_quantiles_of_their_distribution(made, known):
    for share in (0.01, 0.3, 0.5, 0.9, 0.999):
        assert made.value(float(norm.ppf(share))) == pytest.approx(known.ppf(share))


def linear(*slope, at=1.0):
    """g = at + slope·u."""
    direction = np.array(slope)
    return Function(lambda u: at + direction @ u, lambda u: direction)


def test_the_tangent_is_zero_at_its_goal_which_is_nearest_to_the_mean():
    tangent = points._Tangent(np.array([2.0, 1.0]), np.array([-3.0, -4.0]), 5.0)
    assert tangent.distance == pytest.approx(1.0)
    # g = 5 - 3 (x - 2) - 4 (y - 1) = 15 - 3 x - 4 y
    assert tangent.goal == pytest.approx([1.8, 2.4])


@pytest.mark.parametrize("start", [(0.0, 0.0), (5.0, -2.0)])
def test_a_plane_is_solved_in_two_samples_with_its_shares(start):
    found = design_point(linear(-1.2, -1.6, at=4.0), FAILS, np.array(start))
    assert found.converged
    assert found.evaluations == 2
    assert found.point == pytest.approx([1.2, 1.6])
    assert found.index == pytest.approx(2.0)
    assert found.probability == pytest.approx(norm.cdf(-2.0))
    assert found.shares == pytest.approx([0.36, 0.64])


def test_a_search_that_meets_no_answer_goes_half_of_the_way_back():
    asked = []

    def answer(taken, gradient=False):
        (point,) = taken
        asked.append(float(point[0]))
        if point[0] > 2.0:
            return [Sample(point, {}, "failed", "beyond")]
        # g falls ever more steeply, so that the first tangent leads too far
        return [
            Sample(point, {"q": 3.0 - point[0] - point[0] ** 2}, gradient=np.array([-1.0 - 2.0 * point[0]]))
        ]

    found = design_point(answer, FAILS, np.array([-0.25]))
    # g is 3.1875 there and falls by 0.5
    assert asked[:3] == pytest.approx([-0.25, 6.125, 0.5 * (6.125 - 0.25)])
    assert found.point == pytest.approx([0.5 * (np.sqrt(13.0) - 1.0)], abs=2e-3)


def test_without_a_gradient_at_the_start_there_is_no_design_point():
    assert design_point(Function(lambda u: 1.0), FAILS, np.zeros(2)) is None
    assert design_points(Function(lambda u: 1.0), FAILS, 2) == ()


def test_a_search_ends_after_thirty_samples():
    # g is about one everywhere, whatever its gradient promises
    never = Function(lambda u: 1.0 + 0.01 * np.sin(7.0 * u[0]), lambda u: np.array([-1.0]))
    found = design_point(never, FAILS, np.zeros(1))
    assert not found.converged
    assert found.evaluations == never.taken == 30


def ways(*others):
    """g of several planes, of which the least counts: each a distance and a direction."""
    normals = np.array([one for _, one in others], dtype=float)
    apart = np.array([far for far, _ in others])

    def state(u):
        return float((apart - normals @ u).min())

    return Function(state, lambda u: -normals[int(np.argmin(apart - normals @ u))])


def test_all_ways_to_fail_that_matter_are_found_the_most_probable_first():
    both = ways((2.5, (1.0, 0.0)), (3.0, (0.0, -1.0)))
    found = design_points(both, FAILS, 2, (0, 1))
    assert [design.index for design in found] == pytest.approx([2.5, 3.0])
    assert found[1].point == pytest.approx([0.0, -3.0])
    # one that is two standard deviations farther than the first tells nothing
    far = ways((1.0, (1.0, 0.0)), (3.1, (0.0, -1.0)))
    assert [design.index for design in design_points(far, FAILS, 2, (0, 1))] == pytest.approx([1.0])
    # and nothing else is sought where no unknown is named
    assert len(design_points(both, FAILS, 2)) == 1


def test_searches_begin_three_standard_deviations_off_on_both_sides():
    assert [start.tolist() for start in points._starts([1], 2)] == [[0.0, -3.0], [0.0, 3.0]]
    assert points._starts([0], 1) == []
    assert len(points._starts(range(20), 20)) == 16


@pytest.mark.parametrize(("lower", "found"), [(0.49, 0), (0.51, 1)])
def test_another_way_is_sought_where_g_is_half_a_standard_deviation_below_the_tangent(lower, found):
    first = design_point(linear(-2.0, 0.0, at=4.0), FAILS, np.zeros(2))
    start = np.array([0.0, 3.0])
    # the tangent says 4 at the start; its slope is 2
    other = Function(lambda u: 4.0 - 2.0 * u[0] - (2.0 * lower if u[1] > 1.0 else 0.0))
    assert len(points._lower(other, FAILS, first, [start])) == found


def test_the_variance_of_independent_samples_is_that_of_a_share():
    inside = np.array([True] * 3 + [False] * 7)
    assert subset._variance(inside, np.arange(10), 0) == pytest.approx(0.7 / (10 * 0.3))
    assert subset._variance(np.zeros(10, bool), np.arange(10), 0) == 1.0
    assert subset._variance(inside[:1], np.arange(1), 0) == 1.0


def test_the_variance_of_chains_counts_each_as_one():
    inside = np.array([True, True, True, False, False, False, True, False])
    chains = np.array([0, 0, 0, 1, 1, 1, 2, 2])
    share = 0.5
    # sums about the mean by chain: 3 × ½, -3 × ½, 0
    assert subset._variance(inside, chains, 1) == pytest.approx(
        (2 * 1.5**2) / (8 * share) ** 2 + (1.0 - share) / (8 * share)
    )


def test_bounds_of_a_share_are_symmetrical_in_its_logarithm_and_hold_what_has_no_answer():
    found = subset._bounded(0.01, 0.04, 3, 5, 1000, 0.95)
    assert (found.low_value, found.high_value) == (0.01, pytest.approx(0.015))
    assert found.low == pytest.approx(0.01 * np.exp(-1.96 * 0.2), rel=1e-4)
    assert found.high == pytest.approx(0.01 * np.exp(1.96 * 0.2) + 0.005, rel=1e-4)
    assert found.cov == pytest.approx(0.2)
    assert subset._bounded(0.0, 1.0, 0, 0, 10, 0.95).cov == np.inf


def test_levels_of_subset_simulation_keep_a_tenth():
    found = subset.subset(Function(lambda u: 4.0 - u[0]), FAILS, 1, 400, 2, 0.95)
    states = np.sort(found.states)
    assert found.levels[0] == states[39]
    level, at = found.curve[0]
    assert (level, at.low_value) == (states[39], pytest.approx(0.1))
    assert found.curve[1][1].low_value == pytest.approx(0.01, rel=0.1)
    # 40 of each level begin the next, and those that are as good as the last of them
    assert 0.97 * 360 * len(found.levels) < found.evaluations - 400 <= 360 * len(found.levels)


def test_weights_of_samples_are_the_density_over_that_from_which_they_came():
    centres, weight = np.array([[2.0, 0.0], [0.0, -1.0]]), np.array([0.3, 0.7])
    places = np.array([[1.0, 0.5], [-0.3, -2.0]])

    def density(centre):
        return norm.pdf(places - centre).prod(axis=1)

    mixed = 0.3 * density(centres[0]) + 0.7 * density(centres[1])
    assert importance._likelihood(places, centres, weight) == pytest.approx(density([0.0, 0.0]) / mixed)


def test_a_weighted_probability_and_its_interval_count_unknown_samples_on_both_sides():
    states = np.array([-1.0, 1.0, np.nan, -0.5])
    ratios = np.array([0.2, 1.0, 0.4, 0.6])
    found = importance._estimate(states, ratios, 0.95)
    terms = np.array([0.2, 0.0, 0.0, 0.6])
    error = terms.std(ddof=1) / 2.0
    assert (found.low_value, found.high_value) == (pytest.approx(0.2), pytest.approx(0.3))
    assert found.low == pytest.approx(0.2 * np.exp(-1.95996 * error / 0.2), rel=1e-4)
    assert (found.failing, found.unknown, found.count) == (2, 1, 4)
    assert found.cov == pytest.approx(error / 0.2)
    nothing = importance._estimate(np.ones(4), ratios, 0.95)
    assert (nothing.low, nothing.high, nothing.cov) == (0.0, 1.0, np.inf)


def test_levels_of_a_curve_lie_between_the_outer_quantiles():
    taken = Weighted(np.zeros((0, 1)), [], np.zeros(0))
    found = taken.levels(np.append(np.arange(101.0), np.nan), 5)
    assert found == pytest.approx((20.0, 35.0, 50.0, 65.0, 80.0))
    assert taken.levels(np.array([np.nan]), 5) == ()


def test_exact_intervals_leave_half_of_the_rest_on_either_side():
    found = probability(np.where(np.arange(40) < 7, -1.0, 1.0), 0.9)
    assert binom.sf(6, 40, found.low) == pytest.approx(0.05)
    assert binom.cdf(7, 40, found.high) == pytest.approx(0.05)
    assert found.cov == pytest.approx(np.sqrt(0.825 / 7))
    assert found.index[1] == pytest.approx(-norm.ppf(found.low))
    none, every = probability(np.ones(20), 0.9), probability(-np.ones(20), 0.9)
    assert (none.low, none.high) == (0.0, pytest.approx(1.0 - 0.05 ** (1 / 20)))
    assert (every.low, every.high) == (pytest.approx(0.05 ** (1 / 20)), 1.0)


def test_samples_without_an_answer_widen_a_probability():
    states = np.array([-1.0, np.nan, np.nan, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    found = probability(states, 0.95)
    assert (found.low_value, found.high_value, found.failing, found.unknown) == (
        0.1,
        pytest.approx(0.3),
        1,
        2,
    )
    assert found.high == pytest.approx(probability(np.where(np.arange(10) < 3, -1.0, 1.0), 0.95).high)


def test_a_mean_has_students_interval():
    found = mean_of(np.array([1.0, 2.0, 4.0, 5.0, np.nan]), 0.95)
    assert (found.value, found.count) == (3.0, 4)
    assert found.sigma == pytest.approx(np.sqrt(10.0 / 3.0))
    # t of 3 degrees of freedom at 97.5 %
    assert found.high - 3.0 == pytest.approx(3.182446 * found.sigma / 2.0, rel=1e-6)
    assert found.low == pytest.approx(6.0 - found.high)
    one = mean_of(np.array([2.0]), 0.95)
    assert (one.value, one.low, one.high) == (2.0, -np.inf, np.inf)


def test_a_control_that_explains_all_leaves_no_interval():
    control = np.array([1.0, 2.0, 4.0, 7.0, 3.0])
    found = controlled(3.0 + 2.0 * control, control, 5.0, 0.95)
    assert (found.value, found.low, found.high) == pytest.approx((13.0, 13.0, 13.0), abs=1e-6)
    assert found.share == pytest.approx(0.0, abs=1e-12)
    # but the error of its own mean remains, times the slope
    assert controlled(3.0 + 2.0 * control, control, 5.0, 0.95, 0.5).high == pytest.approx(14.0, abs=1e-6)


def test_a_control_that_explains_nothing_leaves_the_interval_of_a_regression():
    # orthogonal to a control whose mean is as expected
    control, values = np.array([-1.0, -1.0, 1.0, 1.0]), np.array([1.0, 3.0, 1.0, 3.0])
    found = controlled(values, control, 0.0, 0.95)
    assert found.value == pytest.approx(2.0)
    # residual variance 4/2, t of 2 degrees of freedom
    assert found.high - 2.0 == pytest.approx(4.302653 * np.sqrt(2.0 / 4.0), rel=1e-6)
    assert found.share == pytest.approx(2.0 / (4.0 / 3.0))
    # where the control is off its mean the intercept is less sure
    off = controlled(values, control, -1.0, 0.95)
    assert off.high - off.value == pytest.approx(4.302653 * np.sqrt(2.0 * (0.25 + 1.0 / 4.0)), rel=1e-6)


@pytest.mark.parametrize(("above", "shares"), [(False, [0.25, 0.75]), (True, [0.75, 0.25])])
def test_a_fragility_curve_counts_values_beyond_its_levels(above, shares):
    curve = fragility(np.array([1.0, 2.0, 3.0, 4.0]), [1.5, 3.5], above, 0.95)
    assert [level for level, _ in curve] == [1.5, 3.5]
    assert [one.low_value for _, one in curve] == shares
    assert quantiles(np.array([0.0, 1.0, np.nan, 2.0]), [0.25, 0.5]) == [0.5, 1.0]


def test_a_departure_is_told_along_the_unknown_where_it_is_largest():
    # two of the largest depart at one standard deviation, the second more
    def value(u):
        return 1.0 + 3.0 * u[0] + 2.0 * u[1] + 0.1 * u[0] ** 2 + 0.4 * u[1] ** 2

    found = first_order(Function(value, lambda u: np.array([3.0, 2.0, 0.0])), "q", 3)
    assert found.sigma == pytest.approx(np.sqrt(13.0))
    assert found.along == 1
    assert found.departure == pytest.approx(0.4 / np.sqrt(13.0))
    assert found.evaluations == 1 + 5 * 2
    assert found.predicted(np.array([[1.0, 1.0, 5.0]])) == pytest.approx([6.0])


def test_a_regression_has_the_slopes_of_a_plane_and_needs_enough_samples():
    places = np.random.default_rng(1).normal(size=(40, 2))
    assert regressed(places, 3.0 + places @ [2.0, -1.0]) == pytest.approx([2.0, -1.0])
    assert regressed(places[:3], np.ones(3)) is None


def test_intervals_of_indices_that_are_certain_close_on_them():
    """Of y = x₁ + x₂ with 4096 samples each index is ½, and its interval is a few hundredths wide."""
    found = sobol(Function(lambda u: u[0] + u[1]), "q", 2, [[0], [1]], 2048, 3, 0.95)
    for index, ends in ((found.first, found.first_interval), (found.total, found.total_interval)):
        assert index == pytest.approx([0.5, 0.5], abs=0.03)
        assert (ends[:, 0] < 0.5).all()
        assert (ends[:, 1] > 0.5).all()
        assert (ends[:, 1] - ends[:, 0] < 0.15).all()


def test_a_measurement_takes_away_the_variance_along_its_direction():
    each = tuple(Unknown(k, "", Distribution(Shape.NORMAL, 0.0, sigma)) for k, sigma in enumerate((1.0, 2.0)))
    about = SimpleNamespace(unknowns=Unknowns(each), dimension=2)
    slope = np.array([3.0, 1.0])
    # one unknown alone; both apart; the same twice
    assert actions._taken(about, slope, [[0]]) == pytest.approx(9.0)
    assert actions._taken(about, slope, [[0], [1]]) == pytest.approx(10.0)
    assert actions._taken(about, slope, [[1], [1]]) == pytest.approx(1.0)
    # their sum, of which the second is a part twice as large: (3·1 + 1·2)² / 5
    assert actions._taken(about, slope, [[0, 1]]) == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("unknown", "value", "rate"),
    [
        (("common", Acts.FACTOR), 1.25, 0.8),
        (("scatter", Acts.FACTOR), 0.25, 0.8),
        (("common", Acts.CHANGE), 100.0, 1.0 / 2000.0),
    ],
)
def test_a_limit_load_changes_with_the_logarithm_of_densities(unknown, value, rate):
    part, acts = unknown
    one = SimpleNamespace(part=part, acts=acts, stones=("A", "B", "absent"))
    about = SimpleNamespace(_densities=lambda _: {"A": 2000.0, "B": 2000.0})
    found = problem.Problem._by_density(about, {"A": 0.3, "B": -0.1}, one, value, None)
    assert found == pytest.approx(0.2 * rate)


def test_forces_carried_into_other_axes_are_the_same_in_space():
    base, force = np.eye(3)[None], np.array([[5.0, 1.0, -2.0]])
    # only the tangential axes turn, about the normal
    c, s = np.cos(0.4), np.sin(0.4)
    frame = np.array([[[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]]])
    found = gradient._carried(base, frame, force)
    assert found[0] @ frame[0] == pytest.approx(force[0] @ base[0])
    assert found[0, 0] == 5.0


def test_unknowns_change_together_where_no_contact_joins_their_stones():
    from scipy.sparse import csr_array

    # a row of five stones, each touching the next; unknown k changes stone k
    touching = csr_array(np.eye(5) + np.eye(5, k=1) + np.eye(5, k=-1))
    batches = gradient._batches(np.eye(5, dtype=bool), touching)
    assert sorted(map(sorted, batches)) == [[0, 2, 4], [1, 3]]
    # one that changes all stones stands alone, and first
    reach = np.vstack([np.eye(5, dtype=bool)[:2], np.ones((1, 5), bool)])
    assert gradient._batches(reach, touching)[0] == [2]


def samples_of(kind, count=400):
    shares = (np.arange(count) + 0.5) / count
    return {"normal": norm.ppf(shares), "uniform": shares, "skew": np.exp(norm.ppf(shares))}[kind]


@pytest.mark.parametrize("unit", [1.0, 1e-4, 1e4])
@pytest.mark.parametrize(("kind", "told"), [("normal", 0), ("uniform", 1), ("skew", 1)])
def test_samples_that_are_not_normal_are_told_with_both_intervals(kind, told, unit):
    values = unit * samples_of(kind)
    estimates = SimpleNamespace(
        linear=object(), gradient=None, weights=None, indices=None, values={"q": values}
    )
    found = summary._departing(estimates)
    assert len(found) == told
    if told:
        half = 0.5 * float(np.ptp(np.quantile(values, [0.025, 0.975])))
        assert f"± {half:.4g}, and a normal one's within ± {1.96 * values.std(ddof=1):.4g}" in found[0]
    assert summary._departing(SimpleNamespace(linear=None, gradient=None, weights=None)) == []
    few = SimpleNamespace(linear=object(), weights=None, indices=None, values={"q": values[:99]})
    assert summary._departing(few) == []
