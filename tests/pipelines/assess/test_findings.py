"""Words of a loading test: the mechanism by the share of turning."""

import pytest

from pipelines.assess.pushover.findings import mechanism_of


@pytest.mark.parametrize(
    ("turning", "words"),
    [
        (1.02, "rocks"),
        (0.85, "rocks"),
        (0.84, "rocks (84 %) and slides"),
        (0.71, "rocks (71 %) and slides"),
        (0.16, "rocks (16 %) and slides"),
        (0.14, "slides in its joints"),
        (-0.01, "slides in its joints"),
    ],
)
def test_rocking_and_sliding_are_named_alone_from_a_share_of_85_percent(turning, words):
    assert mechanism_of(turning) == words
