"""The benchmark of the diagnosis, on few surveys: the true cause is first and its amount within its interval."""

import pytest

from benchmarks.diagnosis import drawn, laboratory


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["core-sunk", "settled-small", "settled-phases", "shaken"])
def test_surveys_made_again_give_the_same_verdict(kind, tmp_path):
    place = laboratory(kind, tmp_path / kind)
    rows = drawn(place, 12)
    # of 12 at 95 % three or more fail in one of fifty
    assert sum(row["covered"] for row in rows) >= 10
    assert all(row["first"] for row in rows)
    assert sum(row["explains"] and row["none"] for row in rows) >= 10
    if place.stood:
        assert sum(row["dated"] for row in rows) >= 10
