"""Walls that laboratories broke: the quickest is predicted, and the table has what it promises."""

import json
import sys

import pytest

from benchmarks import experiments


def test_a_brick_wall_on_two_edges_bears_what_was_measured(monkeypatch, capsys, tmp_path):
    words = ["--only", "specimen 12", "--json", "--figures", str(tmp_path), "--data", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", ["experiments", *words])
    experiments.main()
    (wall,) = json.loads(capsys.readouterr().out)["walls"]
    assert wall["ratio"] == [pytest.approx(1.0, abs=0.1)]
    assert wall["predicted"] == [pytest.approx(wall["measured"][0], rel=0.1)]
    assert (tmp_path / "specimen 12.png").exists()


def test_without_their_outlines_walls_of_rubble_are_left_out(tmp_path):
    rubble = {
        name: one for name, one in experiments.EXPERIMENTS.items() if name in ("SC1", "WR1.100", "WR2.250")
    }
    assert list(experiments._rows(rubble, tmp_path / "none", None)) == []
