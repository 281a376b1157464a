"""Histories: values between the given instants, and exact integrals."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ground.errors import SceneError
from mechanics.scene.loads.time_series import History, Outside

numbers = st.floats(-10, 10).map(lambda x: round(x, 3))


def test_a_scalar_is_linear_between_its_instants_and_held_outside():
    history = History([1.0, 2.0, 4.0], [0.0, 2.0, -2.0])
    found = [float(history(t)) for t in (0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 9.0)]
    assert found == [0.0, 0.0, 1.0, 2.0, 0.0, -2.0, -2.0]


def test_the_integral_is_exact_from_time_zero():
    history = History([1.0, 2.0, 4.0], [3.0, 5.0, -1.0])
    # held before: 3 a second; then trapezoids of 4 and, in two seconds, 4; held after: -1 a second
    areas = {0.0: 0.0, 0.5: 1.5, 1.0: 3.0, 1.5: 3.0 + 1.75, 2.0: 7.0, 4.0: 11.0, 6.0: 9.0}
    for time, area in areas.items():
        assert float(history.integral(time)) == pytest.approx(area, rel=1e-15)


def test_a_vector_is_as_its_components():
    history = History([0.0, 2.0], [[0.0, 1.0, 2.0], [4.0, 1.0, 0.0]])
    assert history.components == 3
    np.testing.assert_allclose(history(0.5), [1.0, 1.0, 1.5])
    np.testing.assert_allclose(history.integral(2.0), [4.0, 2.0, 2.0])


@given(st.lists(st.tuples(st.floats(0.01, 3), numbers), min_size=1, max_size=6), numbers, st.floats(0, 12))
def test_the_integral_agrees_with_quadrature(steps, start, end):
    time = start + np.cumsum([width for width, _ in steps])
    history = History(time, [value for _, value in steps])
    # Gauss–Legendre on each piece between the instants, on which the value is linear
    cuts = np.unique(np.clip([0.0, *time, end], 0.0, end))
    nodes, weights = np.polynomial.legendre.leggauss(2)
    area = sum(
        (b - a)
        / 2
        * sum(w * float(history((a + b) / 2 + (b - a) / 2 * x)) for x, w in zip(nodes, weights, strict=True))
        for a, b in pairwise(cuts)
    )
    assert float(history.integral(end)) == pytest.approx(area, abs=1e-9)


def test_a_constant_holds_at_all_times():
    history = History.constant([1.0, 2.0, 3.0])
    np.testing.assert_array_equal(history(7.0), [1, 2, 3])
    np.testing.assert_allclose(history.integral(2.0), [2, 4, 6])


def test_a_trapezoid_has_its_area_and_no_jumps():
    history = History.trapezoid(2.0, 10.0, [0.0, 0.0, -0.018])
    assert float(history.integral(20.0)[2]) == pytest.approx(-0.018, rel=1e-14)
    assert float(history(7.0)[2]) == pytest.approx(-0.002)  # 18 mm over nine tenths of 10 s
    assert not history(2.0).any()
    assert not history(12.0).any()
    with pytest.raises(SceneError, match="duration = 0 s"):
        History.trapezoid(0.0, 0.0, 1.0)


def test_a_history_may_end():
    history = History([0.0, 1.0], [0.0, 1.0], Outside.ERROR)
    assert float(history(1.0 + 1e-12)) == 1.0
    with pytest.raises(
        SceneError, match=r"t = 1\.1 s lies outside 0 s to 1 s; give the history for the whole run"
    ):
        history(1.1)
    with pytest.raises(SceneError, match="lies outside"):
        history.integral(1.1)


@pytest.mark.parametrize(
    ("time", "value", "said"),
    [
        ([0.0, 1.0], [1.0], "value has 1 entries for 2 times"),
        ([0.0, 1.0, 1.0], [0.0, 0.0, 1.0], "time 1 s comes after 1 s; give increasing times"),
        ([0.0, 1.0], [0.0, np.nan], "entry 2 is not finite"),
        ([0.0, np.inf], [0.0, 1.0], "entry 2 is not finite"),
        ([], [], "are not lists"),
        (0.0, 1.0, "are not lists"),
    ],
)
def test_impossible_histories_are_refused(time, value, said):
    with pytest.raises(SceneError, match="history: ") as caught:
        History(time, value)
    assert said in str(caught.value)
