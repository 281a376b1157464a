"""Walls that laboratories broke: the quickest is predicted, and the table has what it promises."""

import json
import sys
import tomllib

import pytest

from benchmarks import experiments
from synthetic.granite_wall import GRANITE_SCENE


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


@pytest.mark.parametrize("name", sorted(experiments.EXPERIMENTS))
def test_each_input_says_where_it_comes_from(name):
    inputs = experiments.EXPERIMENTS[name].inputs
    assert {"friction", "density"} <= inputs.keys()
    assert not [
        one for one in inputs.values() if not one.origin.startswith(("measured", "of a model (", "assumed"))
    ]


def test_dry_joints_are_as_stiff_as_in_a_first_loading_under_their_pressure():
    """5.9, 7.9 GPa/m at 0.15, 0.5 MPa; between them 6.19 at 0.2 MPa, the load of 40 kN over 0.2 m²."""
    stiffness = [experiments.granite_inputs(load)["normal stiffness"].value for load in (40e3, 100e3, 250e3)]
    assert stiffness == [pytest.approx(6.186e9, rel=1e-3), pytest.approx(7.9e9), pytest.approx(12.9e9)]
    scene = tomllib.loads(GRANITE_SCENE.format(commands=""))
    assert scene["laws"][0]["normal_stiffness"] == pytest.approx(7.9e9)
    assert scene["laws"][0]["shear_stiffness"] == pytest.approx(0.4 * 7.9e9)


def test_the_table_of_inputs_names_the_walls_that_share_one():
    rows = experiments._input_rows(experiments.EXPERIMENTS)
    (row,) = [row for row in rows if row["input"] == "tension" and "0.57" in row["origin"]]
    assert row["value"] == "190 kPa"
    assert row["walls"] == "SC1, SC1, modulus of the mortar as measured"
