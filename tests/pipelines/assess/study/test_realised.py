"""Values of a sample change stones and scenes as they say: materials, depths, corners, planes, loads."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.stones.materials import Material
from pipelines.assess.study.file import _check_input
from pipelines.assess.study.inputs import realise
from pipelines.assess.study.inputs.distributions import Distribution
from pipelines.assess.study.inputs.realise import changed_stones
from pipelines.assess.study.inputs.unknowns import Unknown, Unknowns, expand
from pipelines.assess.study.settings import Acts, InputTable, InputType, Shape
from pipelines.scene.selection import StoneModel
from tests.archmodel.stones import box_stone

CERTAIN = Distribution(Shape.NORMAL, 0.0, 1.0)


def models(**more):
    """Two boxes of 0.6 × 0.4 × 0.3 m, seen from the side of negative y."""
    material = Material("stone", 2000.0, 10e9, 0.2, **more)
    stones = (box_stone("A"), box_stone("B", at=(1.0, 0.5, 0.2)))
    return tuple(StoneModel(stone, material, None) for stone in stones)


def changed(table, *valued, stones=None):
    """The stones by code, with values of unknowns."""
    found = changed_stones(stones or models(), [table], valued)
    return {model.record.code: model for model in found}


def unknown(part="common", acts=Acts.CHANGE, codes=("A",), number=0):
    return Unknown(number, "", CERTAIN, codes, part, acts)


@pytest.mark.parametrize(
    ("acts", "value", "density"),
    [(Acts.VALUE, 1900.0, 1900.0), (Acts.FACTOR, 1.1, 2200.0), (Acts.CHANGE, -50.0, 1950.0)],
)
def test_a_density_is_replaced_multiplied_or_changed_in_the_stones_of_the_unknown(acts, value, density):
    found = changed(InputTable(InputType.DENSITY), (unknown(acts=acts), value))
    assert found["A"].material.density == pytest.approx(density)
    assert found["B"].material.density == 2000.0


@pytest.mark.parametrize(("acts", "density"), [(Acts.FACTOR, 2000.0 * 1.1 * 1.2), (Acts.CHANGE, 2000.3)])
def test_scatter_of_a_factor_is_relative_and_comes_on_top_of_what_stones_have_in_common(acts, density):
    first = (unknown(acts=acts, codes=("A", "B")), 1.1 if acts is Acts.FACTOR else 0.1)
    found = changed(InputTable(InputType.DENSITY), first, (unknown("scatter", acts), 0.2))
    assert found["A"].material.density == pytest.approx(density)


def test_values_of_other_inputs_change_nothing():
    found = changed(InputTable(InputType.DENSITY), (unknown(number=1), 50.0))
    assert found["A"].material.density == 2000.0


def test_what_a_material_does_not_state_cannot_change():
    with pytest.raises(SceneError, match="states no compressive_strength"):
        changed(InputTable(InputType.STRENGTH), (unknown(), 1e5))
    found = changed(InputTable(InputType.STRENGTH), (unknown(), 1e5), stones=models(compressive_strength=2e6))
    assert found["A"].material.compressive_strength == 2.1e6


def test_a_measured_stone_grows_when_joints_are_closed_and_a_solid_at_once():
    table = InputTable(InputType.DEPTH)
    assert changed(table, (unknown(), 0.1))["A"].record.depth == pytest.approx(0.5)
    solid = [StoneModel(replace(box_stone("A"), provenance="drawing"), models()[0].material, None)]
    found = changed(table, (unknown(), 0.1), stones=solid)["A"].record
    assert found.depth == pytest.approx(0.5)
    # the face stays; the back goes from y = 0.4 to 0.5
    assert np.unique(np.round(found.solid_vertices[:, 1], 9)).tolist() == [0.0, 0.5]
    assert np.unique(np.round(found.solid_vertices[:, 0], 9)).tolist() == [0.0, 0.6]


def test_no_stone_is_without_depth():
    with pytest.raises(SceneError, match=r"depth = -0\.1 m"):
        changed(InputTable(InputType.DEPTH), (unknown(), -0.5))


def test_a_station_moves_all_that_it_measured():
    before = {model.record.code: model.record for model in models()}
    found = changed(
        InputTable(InputType.STATION), (unknown("y", codes=("A", "B")), 0.03), (unknown("z"), 0.01)
    )
    for code, move in (("A", [0.0, 0.03, 0.01]), ("B", [0.0, 0.03, 0.0])):
        record = found[code].record
        for name in ("vertices", "points", "outline", "solid_vertices", "centroid"):
            change = getattr(record, name) - getattr(before[code], name)
            assert change == pytest.approx(np.broadcast_to(move, change.shape))
        assert record.offset == pytest.approx(float(record.normal @ record.centroid))


def test_a_plane_rises_and_tilts_about_its_centre():
    record = models()[1].record
    height = changed(InputTable(InputType.PLANE), (unknown("height", codes=("B",)), 0.02))["B"].record
    assert height.outline - record.outline == pytest.approx(np.tile([0.0, -0.02, 0.0], (4, 1)))
    assert height.offset == pytest.approx(record.offset + 0.02)
    for part, axis in (("tilt 1", 0), ("tilt 2", 2)):
        tilted = changed(InputTable(InputType.PLANE), (unknown(part, codes=("B",)), 0.1))["B"].record
        along = (record.outline - record.centroid)[:, axis]
        assert (tilted.outline - record.outline)[:, 1] == pytest.approx(-0.1 * along)
        assert tilted.centroid == pytest.approx(record.centroid)


def test_one_corner_moves_along_one_axis():
    record = models()[0].record
    found = changed(InputTable(InputType.POINT), (unknown("2 z"), 0.005))["A"].record
    change = found.vertices - record.vertices
    assert change[2].tolist() == pytest.approx([0.0, 0.0, 0.005])
    assert np.abs(change).sum() == pytest.approx(0.005)


LOADS = [
    {"type": "force", "force": [0.0, 300.0, 0.0], "stones": ["A"]},
    {"type": "ground_motion", "x": "a.txt"},
    {"type": "tilt", "rate": {"value": 2.0, "unit": "deg/s"}},
]


@pytest.mark.parametrize(("entry", "which"), [(None, {0, 1, 2}), (1, {0}), (2, {1}), (3, {2})])
def test_a_factor_multiplies_all_loads_or_the_one_that_is_named(entry, which):
    tables = {"loads": [dict(load) for load in LOADS]}
    realise._scale_load(tables, InputTable(InputType.LOAD, entry=entry), 1.5)
    force, motion, tilt = tables["loads"]
    assert force["force"] == ([0.0, 450.0, 0.0] if 0 in which else [0.0, 300.0, 0.0])
    assert force["stones"] == ["A"]
    assert motion.get("scale") == (1.5 if 1 in which else None)
    assert tilt["rate"] == {"value": 3.0 if 2 in which else 2.0, "unit": "deg/s"}


@pytest.mark.parametrize(
    ("value", "name"), [(0.0, "a.txt"), (0.32, "a.txt"), (0.34, "b.txt"), (0.99, "c.txt"), (1.0, "c.txt")]
)
def test_a_number_between_0_and_1_names_one_of_a_folder_of_records(tmp_path, value, name):
    for file in ("b.txt", "c.txt", "a.txt"):
        (tmp_path / "records").mkdir(exist_ok=True)
        (tmp_path / "records" / file).write_text("")
    scene = SimpleNamespace(document=SimpleNamespace(path=tmp_path / "scene.toml"))
    tables = {"loads": [{"type": "force"}, {"type": "ground_motion", "y": "records/old.txt"}]}
    realise._name_record(tables, scene, InputTable(InputType.RECORD, folder="records", entry=2), value)
    assert Path(tables["loads"][1]["y"]).name == name
    assert realise.records_of(scene, "nowhere") == []


@pytest.mark.parametrize(("law", "values"), [(None, [0.7, 0.6]), (0, [0.7, None]), (1, [None, 0.6])])
def test_laws_change_all_or_the_one_that_is_named(law, values):
    general, mortar = SimpleNamespace(friction=0.5), SimpleNamespace(friction=0.4)
    scene = SimpleNamespace(
        contact=SimpleNamespace(law=general), laws=(SimpleNamespace(law=mortar),), document=None
    )
    tables = {"laws": [{}]}
    table = InputTable(InputType.FRICTION, law=law, acts=Acts.CHANGE)
    realise._change_laws(tables, scene, table, [(unknown(), 0.2)])
    found = [tables["contact"].get("friction"), tables["laws"][0].get("friction")]
    assert [value and pytest.approx(value) for value in values] == found
    assert realise.law_value(scene, table) == (None if law is None else pytest.approx([0.5, 0.4][law]))


def expanded(table, base=0.0, stones=None):
    given = stones or models()
    return list(expand(3, table, given, frozenset(model.record.code for model in given), base))


@pytest.mark.parametrize(
    ("table", "mean", "sigma"),
    [
        (InputTable(InputType.DENSITY, sigma=50.0), 2000.0, 50.0),
        (InputTable(InputType.DENSITY, cov=0.1), 2000.0, 200.0),
        (InputTable(InputType.DENSITY, cov=0.1, mean=1800.0), 1800.0, 180.0),
        (InputTable(InputType.DENSITY, cov=0.1, acts=Acts.FACTOR), 1.0, 0.1),
        (InputTable(InputType.DENSITY, sigma=20.0, acts=Acts.CHANGE), 0.0, 20.0),
    ],
)
def test_an_unknown_is_about_the_value_of_the_scene_a_factor_of_one_or_no_change(table, mean, sigma):
    (found,) = expanded(table, 2000.0)
    assert (found.distribution.mean, found.distribution.sigma) == (mean, pytest.approx(sigma))
    assert (found.input, found.stones, found.part) == (3, ("A", "B"), "common")


def test_what_is_certain_is_no_unknown_unless_its_value_is_another():
    assert expanded(InputTable(InputType.DENSITY), 2000.0) == []
    assert len(expanded(InputTable(InputType.DENSITY, mean=1900.0), 2000.0)) == 1
    assert [one.part for one in expanded(InputTable(InputType.DENSITY, scatter=20.0), 2000.0)] == [
        "scatter"
    ] * 2


def test_a_triangle_without_a_mode_is_symmetrical():
    (found,) = expanded(
        InputTable(InputType.DENSITY, distribution=Shape.TRIANGULAR, low=1800.0, high=2400.0), 2000.0
    )
    assert found.distribution.mode == 2100.0


def test_planes_and_corners_have_the_standard_deviations_of_the_survey():
    planes = expanded(InputTable(InputType.PLANE, cov=2.0))
    assert [one.part for one in planes] == ["tilt 1", "tilt 2", "height"] * 2
    assert [one.distribution.sigma for one in planes[:3]] == pytest.approx([4e-3, 6e-3, 2e-3])
    corners = expanded(InputTable(InputType.POINT))
    assert len(corners) == 2 * 4 * 3
    assert {one.distribution.sigma for one in corners} == {0.003}
    assert [one.part for one in corners[:4]] == ["0 x", "0 y", "0 z", "1 x"]
    assert corners[3].label.endswith("2 of A, x")


def test_depths_of_a_rule_are_one_unknown_and_measured_ones_each_its_own():
    stones = [
        StoneModel(replace(model.record, depth_origin=origin), model.material, None)
        for origin in ("stone", "rule")
        for model in models()
    ]
    found = expanded(InputTable(InputType.DEPTH, scatter=0.01), stones=stones)
    assert [(one.stones, one.part, one.distribution.sigma) for one in found] == [
        (("A",), "measured", 0.03),
        (("B",), "measured", 0.03),
        (("A", "B"), "common", 0.03),
        (("A",), "scatter", 0.01),
        (("B",), "scatter", 0.01),
    ]


def test_correlated_unknowns_move_together_and_their_gradient_follows():
    each = tuple(Unknown(k, "", Distribution(Shape.NORMAL, 0.0, k + 1.0)) for k in range(3))
    unknowns = Unknowns(each, np.array([0, 2]), np.array([[1.0, 0.0], [0.6, 0.8]]))
    point = np.array([1.0, 2.0, -0.5])
    assert unknowns.values(point) == pytest.approx([1.0, 4.0, 3.0 * (0.6 - 0.4)])
    slope = np.array([0.5, -1.0, 2.0])
    by_differences = [
        slope @ (unknowns.values(point + step) - unknowns.values(point - step)) / 0.2
        for step in 0.1 * np.eye(3)
    ]
    assert unknowns.gradient(point, slope) == pytest.approx(by_differences)


@pytest.mark.parametrize(
    ("mode", "fits"),
    [(None, True), (1800.0, True), (2400.0, True), (1700.0, False), (2500.0, False)],
)
def test_the_mode_of_a_triangle_lies_within_its_ends_and_need_not_be_stated(mode, fits):
    table = InputTable(InputType.DENSITY, distribution=Shape.TRIANGULAR, low=1800.0, high=2400.0, mode=mode)
    if fits:
        _check_input(table, None)
    else:
        with pytest.raises(SceneError):
            _check_input(table, None)
