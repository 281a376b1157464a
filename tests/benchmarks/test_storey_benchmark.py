"""The benchmark of storeys takes a low one from its survey to equilibrium, and says how the cost grows."""

import json
import sys

import pytest

from benchmarks import storey as benchmark


@pytest.mark.slow
def test_a_low_storey_comes_to_equilibrium_and_all_its_parts_are_timed(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["storey", "--courses", "2", "3", "--json"])
    benchmark.main()
    small, large = json.loads(capsys.readouterr().out)
    for row in (small, large):
        assert row["outcome"] == "equilibrium"
        assert row["reaction"] < 1e-6
        assert row["bodies"] > row["stones"]
        parts = [row[key] for key in ("ingest", "core", "closing", "simulation")]
        assert min(parts) > 0.0
        assert row["total"] == pytest.approx(sum(parts))
    assert small["power_total"] is None
    bodies = large["bodies"] / small["bodies"]
    assert bodies ** large["power_total"] == pytest.approx(large["total"] / small["total"])
