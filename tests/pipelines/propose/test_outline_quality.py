"""Masonry quality of a picture: what outlines tell is graded, what they do not tell is said."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.propose.outlines import quality
from pipelines.propose.outlines.features import Feature
from pipelines.propose.outlines.quality import quality_facts
from survey.clouds.settings import CloudOptions


def wall(stagger, height=0.3, length=0.6, rows=6, columns=6, cut=()):
    """Outlines of a running bond whose head joints are away from those below by a part of a stone's length."""
    out = []
    for row in range(rows):
        start = stagger * length * (row % 2)
        for column in range(columns):
            left, low = start + column * length, row * height
            right, top = left + length - 0.01, low + height - 0.01
            ring = np.array([[left, low], [right, low], [right, top], [left, top]])
            said = {"kind": "stretcher", "course": row + 1, "sigma": 0.002}
            code = f"C{row + 1:02d}-{column + 1:02d}"
            out.append(
                Feature(code, ring, said | ({"cut": "by the edge of the picture"} if code in cut else {}))
            )
    return out


def test_a_good_bond_is_graded_and_mortar_is_not_seen():
    facts = dict(quality_facts(wall(0.5)))
    assert facts["SD, size of the stones"].startswith("F: ")
    assert facts["SS, shape of the stones"].startswith("F: 100 %")
    assert facts["HJ, level beds"].startswith("F: ")
    assert facts["VJ, staggered head joints"].startswith("F: ")
    index = facts["Index of quality (IQM, 0 to 10)"]
    assert index.endswith("not seen: state of the stones, mortar")


def test_head_joints_above_each_other_are_not_staggered():
    trace = dict(quality_facts(wall(0.0)))["VJ, staggered head joints"]
    assert trace.startswith("NF: minimum trace 1.0")


@pytest.mark.parametrize("many", [0, 7])
def test_few_stones_tell_nothing_and_those_that_are_cut_do_not_count(many):
    assert quality_facts(wall(0.5)[:many]) == []
    codes = tuple(f"C{row:02d}-01" for row in range(1, 7))
    whole, less = (dict(quality_facts(wall(0.5, cut=cut)))["HJ, level beds"] for cut in ((), codes))
    assert "30 head joints" in whole
    assert "24 head joints" in less


def test_a_corner_without_a_deviation_has_that_of_drawn_outlines(monkeypatch):
    judged = []
    monkeypatch.setattr(quality, "judge_masonry", lambda stones, walls: judged.extend(stones) or [])
    bare = [replace(feature, said={"kind": "stretcher"}) for feature in wall(0.5)]
    quality_facts([*bare[:2], *wall(0.5)[2:4]])
    assert [stone.sigma for stone in judged] == [CloudOptions.outline_sigma] * 2 + [0.002] * 2
