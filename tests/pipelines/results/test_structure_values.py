"""Results of stones and structures by hand: of joints that open, in the summary, the report and the page."""

import re
from dataclasses import replace

import numpy as np
import pytest

from archmodel.quantities import QUANTITIES, quantities_of
from archmodel.relations.members import StructureMembers
from archmodel.tables.structures import structure_kinds
from pipelines.reports.page.scenes import run_model
from pipelines.reports.run import write_report
from pipelines.results.stone_values import stone_results
from pipelines.results.structure_values import COMPUTED, structure_results
from pipelines.results.summary import summarise
from tests.pipelines.results_by_hand import result_of, rigid_body

KINDS = ("structure", "course")
COURSES = (
    StructureMembers(4, "course 1", KINDS, frozenset({"base"})),
    StructureMembers(7, "course 2", KINDS, frozenset({"A", "elsewhere"})),
    StructureMembers(9, "course 3", KINDS, frozenset({"B"})),
    StructureMembers(11, "course 4", KINDS, frozenset({"alone"})),
    StructureMembers(12, "WALL", ("structure", "wall"), frozenset({"base", "A", "B"})),
)


@pytest.fixture(scope="module")
def opened():
    """Three stones upon another, whose two joints have opened by 0.3 and by 2 mm, and one that touches none."""
    boxes = [rigid_body(code, (0, 0, z), (1, 1, z + 1)) for z, code in enumerate(("base", "A", "B"))]
    forces = ((0.0, 0.0, 2e4), (0.0, 0.0, 1e4))
    result = result_of(
        [*boxes, rigid_body("alone", (5, 0, 0), (6, 1, 1))], pairs=((1, 0), (2, 1)), forces=forces
    )
    return replace(result, joints=replace(result.joints, opening=np.array([3e-4, 2e-3])))


def test_every_result_of_structures_in_the_catalogue_has_its_function():
    assert set(COMPUTED) == set(quantities_of(*structure_kinds()))


def test_names_are_unique_among_the_results_of_a_bearer():
    assert len({(one.of, one.name) for one in QUANTITIES}) == len(QUANTITIES)


def test_a_course_cracks_as_wide_as_the_widest_joint_of_its_stones(opened):
    """A bed joint is one of the course below and of that above; a wall has no crack width, nor a stone apart."""
    widths = {one.code: one.values["crack_width"] for one in structure_results(opened, COURSES)}
    assert widths == {"course 1": 3e-4, "course 2": 2e-3, "course 3": 2e-3}


def test_the_crack_widths_are_in_the_summary_the_report_and_the_page(opened, tmp_path):
    structures = structure_results(opened, COURSES)
    summary = summarise(opened, version="1", seconds={}, structures=structures)
    assert summary["structures"][0] == {"code": "course 1", "kind": "course", "crack_width": 3e-4}
    stones = stone_results(opened)
    write_report(tmp_path / "report.html", opened, summary, stones, [])
    section = (tmp_path / "report.html").read_text().split("<h2>Results by course</h2>")[1]
    cells = re.findall(r">([^<>\n]+)</t[hd]>", section.split("</table>")[0])
    assert cells == ["Course", "Crack width", "course 2", "2 mm", "course 3", "2 mm", "course 1", "0.3 mm"]
    model = run_model(opened, stones, np.array([0.0, -1.0, 0.0]), np.zeros(3), structures=structures)
    (column,) = (one for one in model.columns if one.name == "course_crack_width")
    assert (column.label, column.unit) == ("crack width of its course", "m")
    np.testing.assert_array_equal(column.values, [3e-4, 2e-3, 2e-3, np.nan])


@pytest.fixture
def tower():
    """Four stones on top of each other, with three joints of kern 0.6, 1.2 and 1.8 under 3, 2 and 1 kN."""
    bodies = [rigid_body(f"S{k}", (0, 0, k), (1, 1, k + 1)) for k in range(4)]
    pairs, forces = ((1, 0), (2, 1), (3, 2)), ((0, 0, 3000.0), (0, 0, 2000.0), (0, 0, 1000.0))
    return result_of(bodies, pairs=pairs, forces=forces)


def values(result, name):
    return [stone.values.get(name) for stone in stone_results(result)]


def test_each_stone_has_the_worst_of_its_joints(tower):
    assert values(tower, "joint_kern") == pytest.approx([0.6, 1.2, 1.8, 1.8])
    assert values(tower, "joint_pressure") == pytest.approx([4500.0, 4500.0, 3000.0, 1500.0])
    assert values(tower, "joint_sliding") == pytest.approx([1e-3, 2e-3, 3e-3, 3e-3])


def test_pressure_and_kern_of_slivers_are_left_out_but_not_how_far_they_slid(tower):
    joints = replace(tower.joints, sliver=np.array([False, False, True]))
    found = replace(tower, joints=joints)
    assert values(found, "joint_kern") == [pytest.approx(0.6), pytest.approx(1.2), pytest.approx(1.2), None]
    assert values(found, "joint_pressure") == [4500.0, 4500.0, 3000.0, None]
    assert values(found, "joint_sliding") == pytest.approx([1e-3, 2e-3, 3e-3, 3e-3])
