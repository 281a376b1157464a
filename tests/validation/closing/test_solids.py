"""Assemblies rounded to a millimetre, closed again: hexagonal stones of a dome, angled stones that are not convex."""

import numpy as np
import pytest

from survey.extrusion.imported_solids import block_of_solid
from survey.geometry.convex_parts import convex_parts
from survey.joints.close import close_joints
from survey.joints.settings import JointSettings
from survey.records.survey import SolidRecord
from survey.simplify.simplify import simplify
from tests.validation.closing.assemblies import RoundedAssembly, angled_pier, hexagonal_dome
from tests.validation.closing.closing_truth import judge

ASSEMBLIES = {
    "dome": lambda: hexagonal_dome(60),
    "angled pier": angled_pier,
    "large dome": lambda: hexagonal_dome(300, radius=6.0, thickness=0.4),
}


@pytest.fixture(params=["dome", "angled pier", pytest.param("large dome", marks=pytest.mark.slow)])
def assembly(request: pytest.FixtureRequest) -> RoundedAssembly:
    return ASSEMBLIES[request.param]()


def test_rounded_solids_are_closed_onto_common_planes(assembly: RoundedAssembly) -> None:
    """Faces shared within 10⁻⁹ m, no overlap above 10⁻⁹ m³, 95 % of the area; nothing moves by more than 5 mm."""
    blocks = [
        block_of_solid(SolidRecord(one.code, "ashlar", None, one.vertices, one.faces), None, "rounded.obj")
        for one in assembly.solids
    ]
    closed = close_joints(blocks, JointSettings(max_displacement=0.005))
    parts = [part for solid in closed.solids for part in convex_parts(solid)]
    before = [simplify(block).solid for block in blocks]
    verdict = judge(closed, before, assembly.joints, parts)
    print(f"\n{assembly.name}: {verdict.line()}")
    assert verdict.plane_error <= 1e-9, verdict.line()
    assert verdict.flatness <= 1e-9, verdict.line()
    assert verdict.overlap <= 1e-9, verdict.line()
    assert verdict.found_share >= 0.95, verdict.line()
    assert {pair for pair in verdict.below(0.8) if verdict.areas[pair] > 2e-3} == set()
    assert verdict.moved <= 0.005
    for solid, true in zip(closed.solids, assembly.truth, strict=True):
        apart = np.linalg.norm(true.vertices[:, None] - solid.vertices[None], axis=2).min(axis=1)
        assert apart.max() < 0.005 + 0.5e-3 * 3**0.5, solid.code  # the bound, and what was rounded off
