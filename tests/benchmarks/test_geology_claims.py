"""Claims of the paper are judged by numbers: courses that hold, that fail, and that tell nothing."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks import geology
from benchmarks.claims import Run, verdict_of
from benchmarks.claims_fault import FAULT
from benchmarks.claims_fold import FOLD
from benchmarks.geology_claims import findings, rows_of
from benchmarks.geology_scales import shear_by_height

TIME = np.linspace(0.0, 1.0, 201)[1:]
CLAIMS = {(claim.kind, claim.name): claim for claim in (*FOLD, *FAULT)}
GAMMAS = (0.0, 1e3, 1e4, 1e5)


def column(*values):
    """Interpolate a curve between values at equal distances in time."""
    return np.interp(TIME, np.linspace(0.0, 1.0, len(values)), values)


def run(gamma=0.0, seed=1, cells=None, course=None, **last):
    columns = {name: {"time": TIME, **content} for name, content in (cells or {}).items()}
    return Run(gamma, seed, columns, {"time": TIME, **(course or {})}, last)


def verdict(kind, name, runs):
    (row,) = rows_of([CLAIMS[kind, name]], runs)
    return row["verdict"]


def seeds(make):
    """Make runs of five seeds, whose numbers differ by a few percent."""
    return [one for seed in range(5) for one in make(seed, 1.0 + 0.02 * (seed - 2))]


def fault(make, gammas=GAMMAS):
    return seeds(lambda seed, scale: [replace(make(gamma, scale), seed=seed) for gamma in gammas])


def test_an_interval_above_zero_agrees_below_contradicts_and_across_tells_nothing():
    assert verdict_of([0.2, 0.3, 0.25]).words == "agrees"
    assert verdict_of([-0.2, -0.3, -0.25]).words == "contradicts"
    assert verdict_of([-0.2, 0.3, 0.25]).words == "cannot be told"
    # 2.776 is Student's t of five seeds
    five = verdict_of([0.1, 0.2, 0.3, 0.4, 0.5])
    assert five.within == pytest.approx(2.776 * np.sqrt(0.025) / np.sqrt(5.0), rel=1e-3)


def test_a_single_run_takes_the_deviation_of_others_and_tells_nothing_without():
    assert verdict_of([0.5]).words == "cannot be told"
    assert verdict_of([0.5], [0.1, 0.12, 0.08]).words == "agrees"
    assert verdict_of([0.01], [0.1, 0.12, 0.08]).words == "cannot be told"
    assert verdict_of([0.5, float("nan")]).words == "cannot be told"


@pytest.mark.parametrize(
    ("p", "expected"),
    [
        (lambda scale: column(3.0, 2.0, 1.0) * scale, "agrees"),
        (lambda scale: column(1.0, 1.5) * scale, "contradicts"),
        # falls first and rises at the end
        (lambda scale: column(3.0, 2.0, 1.0, 2.0), "contradicts"),
        (lambda scale: 2.0 + (scale - 1.0) * TIME, "cannot be told"),
    ],
)
def test_the_stress_of_w2_falls_in_every_quarter_or_the_claim_fails(p, expected):
    runs = seeds(lambda seed, scale: [run(seed=seed, cells={"W2": {"p": p(scale)}})])
    assert verdict("fold", "W2 p", runs) == expected


@pytest.mark.parametrize(
    ("q", "expected"),
    [
        (lambda scale: column(1.0, 1.05 * scale), "agrees"),
        (lambda scale: column(1.0, 3.0 * scale), "contradicts"),
        # the mean of the last quarter is 1.2 times that of the first
        (lambda scale: column(1.0, 1.0 + 0.2759 * scale**4), "cannot be told"),
    ],
)
def test_w6_is_constant_within_a_fifth(q, expected):
    runs = seeds(lambda seed, scale: [run(seed=seed, cells={"W6": {"q": q(scale)}})])
    assert verdict("fold", "W6 q", runs) == expected


def test_the_most_stressed_cells_exceed_all_others():
    def runs(third, fourth):
        peaks = {"W1": 1.0, "W2": 2.0, "W3": third, "W4": fourth, "W5": 1.0, "W6": 0.5}
        return seeds(
            lambda seed, scale: [
                run(
                    seed=seed,
                    cells={
                        name: {"p": column(0.0, peak) * scale ** (name == "W2")}
                        for name, peak in peaks.items()
                    },
                )
            ]
        )

    assert verdict("fold", "most stressed p", runs(3.0, 2.5)) == "agrees"
    assert verdict("fold", "most stressed p", runs(3.0, 1.5)) == "contradicts"
    assert verdict("fold", "most stressed p", runs(3.0, 2.0)) == "cannot be told"


def test_a_front_that_follows_the_wall_by_a_straight_line_contradicts_and_one_that_stops_agrees():
    def runs(front):
        course = {"rear [m]": 80.0 * TIME, "front [m]": front}
        return seeds(lambda seed, scale: [run(seed=seed, course=course, resolution=10.0 * scale)])

    assert verdict("fold", "front", runs(100.0 + 100.0 * TIME)) == "contradicts"
    assert verdict("fold", "front", runs(100.0 + column(0.0, 80.0, 80.0))) == "agrees"


def test_phases_of_the_fault_are_judged_for_every_cohesion():
    def runs(q):
        def make(gamma, scale):
            p = np.interp(TIME, [0.0, 0.25, 1.0], [1.0, 2.0, 2.1]) * scale
            return run(gamma, cells={"W1": {"p": p, "q": q(gamma)}})

        return fault(make)

    level = runs(lambda gamma: np.interp(TIME, [0.0, 0.25, 1.0], [1.0, 1.0, 1.5]))
    assert [verdict("fault", name, level) for name in ("p grows", "q stays", "p stays", "q grows")] == [
        "agrees"
    ] * 4
    falls = runs(lambda gamma: column(2.0, 1.0, 0.9, 0.8, 0.7) if gamma == 1e4 else column(1.0, 1.1))
    assert verdict("fault", "q stays", falls) == "contradicts"
    assert verdict("fault", "q grows", falls) == "contradicts"


@pytest.mark.parametrize(
    ("ratio", "expected"), [(2.1, "agrees"), (1.2, "contradicts"), (1.6, "cannot be told")]
)
def test_twice_the_pressure_is_within_a_fifth_of_two(ratio, expected):
    def make(gamma, scale):
        # the others stay, so that the ratio varies by some percent
        return run(gamma, cells={"W1": {"p": column(1.0) * (ratio * scale if gamma == 1e5 else 1.0)}})

    assert verdict("fault", "p twice", fault(make)) == expected


def test_the_limits_lie_above_the_dip_for_small_cohesion_and_below_for_the_largest():
    def make(angle):
        return lambda gamma, scale: run(
            gamma, course={"limits, θ_l [°]": column(angle(gamma)) * scale}, dip=30.0
        )

    paper = fault(make(lambda gamma: 25.0 if gamma == 1e5 else 40.0))
    names = ("limits, small γ", "limits, largest γ", "limits fall")
    assert [verdict("fault", name, paper) for name in names] == ["agrees"] * 3
    steep = fault(make(lambda gamma: 40.0))
    assert verdict("fault", "limits, largest γ", steep) == "contradicts"
    assert verdict("fault", "limits fall", fault(make(lambda gamma: 30.0))) == "cannot be told"


def test_lengths_that_fall_and_grow_are_told_from_those_that_only_grow():
    def make(curve):
        return lambda gamma, scale: run(
            gamma, cells={"W1": {"lambda_x": 1.0 + curve * scale, "lambda_y": TIME}}
        )

    assert verdict("fault", "λx", fault(make(column(0.0, -0.2, 0.3)))) == "agrees"
    assert verdict("fault", "λx", fault(make(column(0.0, 0.3)))) == "contradicts"
    assert verdict("fault", "λy", fault(make(column(0.0, 0.3)))) == "cannot be told"


def test_seeds_without_all_cohesions_are_left_out_and_numbers_have_deviations():
    def make(gamma, scale):
        return run(gamma, detached=0.01 * scale if gamma == 1e5 else 0.0)

    runs = [one for one in fault(make) if (one.seed, one.gamma) != (4, 1e3)]
    claim = CLAIMS["fault", "blocks"]
    assert len(findings(claim, runs)) == 4
    (row,) = rows_of([claim], runs)
    assert (row["seeds"], row["verdict"]) == (4, "agrees")
    assert row["numbers"].endswith("γ = 100000 N: 0.0099 (± 0.0003)")


def test_every_claim_has_a_name_of_its_own_words_and_a_criterion():
    assert len(CLAIMS) == len(FOLD) + len(FAULT)
    assert all(claim.words and claim.criterion for claim in CLAIMS.values())


def test_a_measure_that_some_motions_do_not_determine_says_of_how_many_seeds_it_is():
    runs = [{"P/S": 0.5}, {"P/S": 0.7}, {}]
    assert geology._determined(runs, "P/S", 1) == "0.6 ± 0.1 (2 seeds)"
    assert geology._determined([{}], "P/S", 1) == "not determined"


def test_shear_is_told_by_height_in_diameters():
    """Within each band x grows with the height, at another rate."""
    rates = (13.0, 3.0, 1.5, 1.0)
    start = np.random.default_rng(1).uniform(0.0, 15.0, (4000, 2))
    band = np.searchsorted((1.5, 3.0, 5.0, 10.0), start[:, 1]) - 1
    chosen = band >= 0
    start, rate = start[chosen], np.array(rates)[band[chosen]]
    now = np.column_stack([start[:, 0] + rate * start[:, 1], start[:, 1]])
    assert shear_by_height(0.2 * start, 0.2 * now, 0.2) == pytest.approx(rates)
