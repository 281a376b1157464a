"""The benchmark of limit loads: what it measures of a façade, what it keeps, and the tables that it writes."""

import json
import sys

import pytest

from benchmarks import limit as benchmark
from ground.errors import UsageError

NAME = "4 × 6, 0, 0.7, out"


def measured(monkeypatch, capsys, folder, *more):
    monkeypatch.setattr(sys, "argv", ["limit", "--out", str(folder), "--only", NAME, *more])
    benchmark.main()
    return capsys.readouterr().out


def test_a_facade_without_returns_tips_as_its_limit_says(monkeypatch, capsys, tmp_path):
    (row,) = json.loads(measured(monkeypatch, capsys, tmp_path / "kept", "--runs", "--json"))
    # a wall of 0.04 m, 6 courses of 0.028 m high
    assert row["candidate"] == pytest.approx(0.04 / 0.168, rel=1e-3)
    assert row["limit"] <= row["candidate"] * (1 + 1e-12) < 1.002 * row["limit_lost"]
    assert row["held"] <= row["candidate"] * (1 + 1e-12) < 1.002 * row["lost"]
    assert row["verdict"] == "yes"
    assert row["cosine"] > 0.99
    assert row["common"] == 1.0
    (kept,) = (tmp_path / "kept").iterdir()
    kept.write_text(json.dumps(row | {"lost": 0.25}), encoding="utf-8")
    monkeypatch.setattr(benchmark, "measured", lambda *_: pytest.fail("measured again"))
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- limit -->\n<!-- /limit -->\nafter\n", encoding="utf-8")
    monkeypatch.setattr(benchmark, "_PAGE", page)
    assert "0.2500" in measured(monkeypatch, capsys, tmp_path / "kept", "--runs", "--write")
    written = page.read_text(encoding="utf-8")
    assert row["commit"] in written
    assert written.count(f"| {NAME}") == 2
    assert written.startswith("before\n")
    assert written.endswith("after\n")


def test_cases_that_are_not_known_are_refused(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "argv", ["limit", "--out", str(tmp_path), "--only", "W99"])
    with pytest.raises(UsageError, match=r"no such case: 'W99'; give some of W01; W02"):
        benchmark.main()
