"""Generalised least squares through beds, against the same with the whole covariance matrix."""

import numpy as np
import pytest

from survey.quality.bed_fit import BedCorners, BedScatter, fit_bed, pool, scatter_of


def beds(rng: np.random.Generator, stones: int, tau: float, kappa: float) -> BedCorners:
    """Draw one to three corners a stone, with standard deviations of their own."""
    number = np.repeat(np.arange(stones), rng.integers(1, 4, stones))
    along = np.sort(rng.uniform(0.0, 0.6 * stones, len(number)))
    sigma = rng.uniform(0.001, 0.003, len(number))
    height = 287.0 + 0.002 * along + rng.normal(0, tau, stones)[number] + rng.normal(0, kappa * sigma)
    return BedCorners(number, along, height, sigma)


@pytest.mark.parametrize("parameters", [1, 2, 3])
@pytest.mark.parametrize(("tau", "kappa"), [(0.0, 1.0), (0.004, 1.0), (0.01, 2.5)])
def test_values_and_covariance_are_those_of_the_full_matrix(
    parameters: int, tau: float, kappa: float
) -> None:
    bed = beds(np.random.default_rng(parameters), 9, tau, kappa)
    design = (bed.along - (bed.along[0] + bed.along[-1]) / 2)[:, None] ** np.arange(parameters)
    same = bed.stone[:, None] == bed.stone[None, :]
    whole = np.diag((kappa * bed.sigma) ** 2) + tau**2 * same
    weight = np.linalg.inv(whole)
    covariance = np.linalg.inv(design.T @ weight @ design)
    expected = covariance @ design.T @ weight @ (bed.height - 287.0)
    values, found = fit_bed(bed, BedScatter(tau, kappa, 5), parameters)
    expected[0] += 287.0
    assert values == pytest.approx(expected, abs=1e-10)
    assert found == pytest.approx(covariance, rel=1e-9, abs=1e-18)


def test_the_scatter_satisfies_the_equation_of_paule_and_mandel() -> None:
    """With equal variances v of the stones' means the equation has the solution τ² = s² - v, s² about the line."""
    rng = np.random.default_rng(4)
    number = np.repeat(np.arange(12), 2)
    along = np.arange(24) * 0.3
    height = rng.normal(0, 0.005, 12)[number]
    bed = BedCorners(number, along, height, np.full(24, 0.002))
    scatter = scatter_of(bed, 1)
    assert scatter.kappa == 1.0
    means = height[::2]
    assert scatter.tau**2 == pytest.approx(means.var(ddof=1) - 0.002**2 / 2, rel=1e-4)
    assert scatter.freedom == 11


def test_beds_that_differ_by_no_more_than_was_measured_do_not_scatter() -> None:
    rng = np.random.default_rng(6)
    found = [scatter_of(beds(rng, 30, 0.0, 1.0), 2) for _ in range(200)]
    zero = np.mean([one.tau == 0.0 for one in found])
    assert 0.3 < zero < 0.75  # as often as chi-square is below its mean, about half
    assert np.mean([one.kappa for one in found]) < 1.12


def test_corners_of_one_stone_that_scatter_more_than_measured_are_noticed() -> None:
    rng = np.random.default_rng(7)
    found = [scatter_of(beds(rng, 60, 0.003, 3.0), 2).kappa for _ in range(50)]
    assert np.mean(found) == pytest.approx(3.0, rel=0.05)


def test_scatters_are_pooled_by_their_freedom() -> None:
    pooled = pool([BedScatter(0.003, 1.0, 10), BedScatter(0.006, 2.0, 5)])
    assert pooled is not None
    assert pooled.tau == pytest.approx(np.sqrt((10 * 9 + 5 * 36) / 15) * 1e-3)
    assert pooled.kappa == pytest.approx(np.sqrt((10 + 5 * 4) / 15))
    assert pooled.freedom == 15
    assert pool([]) is None
