"""Cost in accuracy of leaving the rest rigid: `python -m benchmarks.region [--structures NAME …] [--json]`.

Stress is asked for in a region. It deforms with a ring of neighbours, all other stones are rigid; what comes of it is
compared with the same stones when all of them deform. See docs/accuracy.md, section 13.
"""

import argparse
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.report import ROOT, Row, columns, guarded, options_of, progress, show
from mechanics.results.result import BodyResult, Result
from mechanics.scene.scene import Block, Fidelity, Scene, SolverSettings, Start, TimeSettings
from mechanics.simulate import simulate
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from pipelines.results.quantities import Quantities, differences, quantities
from pipelines.run.fidelity import Wishes, modelled, neighbours
from survey.extrusion.extrusion import SurveyedBlock
from survey.formats.reading import open_survey
from survey.geometry.solids import Solid
from survey.joints.close import close_joints
from survey.joints.report import StoneJoint
from survey.registration.stones import survey_stones
from synthetic.buildings.openings import ArchShape
from synthetic.buildings.vaults import semicircular_arch
from synthetic.buildings.walls import wall

_SAMPLE = ROOT / "data/samples/window/window.moma"
_STONE = Material("limestone", density=2350.0, young=12e9, poisson=0.2)
_RINGS = (0, 1, 2, 3)
_TABLE = columns(
    "structure structure | region region | ring ring | coarser mesh of the ring | "
    "deformable deformable :d | mean mean % :.1f | p99 1 % above, % :.1f | max largest % :.1f | "
    "each mean of each stone % :.1f | reactions reactions % :.1f | forces joint forces % :.1f | "
    "moved displacement % :.1f | unknowns unknowns :d | cpu_s CPU s :.3g | outcome outcome"
)


@dataclass(frozen=True)
class Structure:
    """Closed stones, their joints, which of them are the ground, and regions of interest by name."""

    solids: tuple[Solid, ...]
    joints: tuple[StoneJoint, ...]
    ground: frozenset[str]
    regions: Mapping[str, frozenset[str]]


def main() -> None:
    """Run every region of every structure with every ring, and print."""
    parser = options_of("region", __doc__)
    parser.add_argument("--structures", nargs="+", choices=list(_STRUCTURES), default=list(_STRUCTURES))
    parser.add_argument("--regions", nargs="+", help="their names, e.g. keystone (all)")
    parser.add_argument("--rings", nargs="+", type=int, default=_RINGS, help="joints (0 1 2 3)")
    parser.add_argument(
        "--size", type=float, default=0.3, help="edge length of the finite elements [m] (0.3)"
    )
    parser.add_argument(
        "--coarser", nargs="+", type=float, default=[1.0], help="edge lengths in the ring, over that (1)"
    )
    options = parser.parse_args()
    simulate(_scene(_STRUCTURES["arch"](), {}, options.size, 1.0))  # compiles the kernels
    rows = [row for name in options.structures for row in _rows(name, options)]
    show(rows, _TABLE, as_json=options.json)


def _sample() -> Structure:
    surveyed = survey_stones(open_survey(_SAMPLE, "moma")).stones
    stones = [one for one in surveyed if isinstance(one, SurveyedBlock)]
    arch = {one.code for one in stones if one.code.startswith("V")}
    regions = {
        "keystone": {"V4"},
        "arch": arch,
        "stone of the wall": {"W05-03"},
        "sill": {_first(stones, "sill")},
    }
    return _structure(stones, {one.code for one in stones if one.course == 1}, regions)


def _arch() -> Structure:
    building = semicircular_arch(17)
    stones = building.blocks()
    by_place = [one.code for one in stones]
    regions = {"keystone": {by_place[8]}, "haunch": {by_place[3]}, "three at the crown": {*by_place[7:10]}}
    return _structure(stones, set(building.base), regions)


def _opening() -> Structure:
    building = wall(60, seed=2, arch=ArchShape.SEGMENTAL)
    stones = building.blocks()
    arch = {one.code for one in stones if one.kind in ("voussoir", "keystone", "springer")}
    third = [one.code for one in stones if one.course == 3]
    regions = {"keystone": {_first(stones, "keystone")}, "arch": arch, "stone of the wall": {third[1]}}
    return _structure(stones, set(building.base), regions)


_STRUCTURES: Mapping[str, Callable[[], Structure]] = {
    "sample": _sample,
    "arch": _arch,
    "opening": _opening,
}


def _first(stones: list[SurveyedBlock], kind: str) -> str:
    return next(one.code for one in stones if one.kind == kind)


def _structure(stones: list[SurveyedBlock], ground: set[str], regions: Mapping[str, set[str]]) -> Structure:
    closed = close_joints(stones)
    return Structure(
        closed.solids,
        closed.report.joints,
        frozenset(ground),
        {name: frozenset(codes - ground) for name, codes in regions.items()},
    )


def _rows(name: str, options: argparse.Namespace) -> Iterator[Row]:
    """All regions of a structure beside the whole of it deforming."""
    progress(f"{name}: all stones deform")
    structure = _STRUCTURES[name]()
    every = {solid.code: (Fidelity.DEFORMABLE, 0) for solid in structure.solids}
    whole, cpu = _run(_scene(structure, every, options.size, 1.0))
    yield _row(name, "all", "–", 1.0, quantities(whole), whole, cpu)
    graph = neighbours(structure.joints)
    codes = [solid.code for solid in structure.solids]
    held = dict.fromkeys(structure.ground, Fidelity.FIXED)
    for region, stones in structure.regions.items():
        if options.regions is not None and region not in options.regions:
            continue
        reference = quantities(replace(whole, bodies=tuple(_seen(one, stones) for one in whole.bodies)))
        for ring in options.rings:
            for coarser in options.coarser if ring else options.coarser[:1]:
                progress(f"{name}: {region}, ring {ring}")
                chosen = modelled(codes, graph, Wishes(held, None, stones, ring=ring))
                models = {code: (one.fidelity, one.ring) for code, one in chosen.items()}
                result, cpu = _run(_scene(structure, models, options.size, coarser, stones))
                found = quantities(result)
                row = _row(name, region, str(ring), coarser, found, result, cpu)
                yield row | _apart(found, reference, stones)


def _scene(
    structure: Structure,
    models: Mapping[str, tuple[Fidelity, int]],
    size: float,
    coarser: float,
    stressed: frozenset[str] | None = None,
) -> Scene:
    """The structure at rest under its weight, as the sample's scene has it; `coarser`: the ring's mesh over `size`."""
    blocks = []
    for solid in structure.solids:
        fidelity, ring = models.get(solid.code, (Fidelity.RIGID, 0))
        fidelity = Fidelity.FIXED if solid.code in structure.ground else fidelity
        own = size * coarser if ring else size
        blocks.append(
            Block(
                solid.code,
                solid.vertices,
                solid.faces,
                _STONE,
                fidelity,
                own if fidelity is Fidelity.DEFORMABLE else None,
                Element.TET10,
                stress=stressed is None or solid.code in stressed,
            )
        )
    return Scene(
        "region",
        tuple(blocks),
        time=TimeSettings(0.003, 1.0, 1.0, relaxation=True, start=Start.EQUILIBRIUM),
        solver=SolverSettings(tolerance=1e-6, velocity_tolerance=1e-4),
    )


def _run(scene: Scene) -> tuple[Result, float]:
    """The result, and the processor time that it took [s]."""
    begun = time.process_time()
    result = simulate(scene)
    return result, time.process_time() - begun


def _seen(body: BodyResult, stones: frozenset[str]) -> BodyResult:
    """The body, without its stress if it is none of these."""
    if body.code in stones:
        return body
    return replace(body, stress=None, von_mises=None, principal=None, values=None)


def _row(
    structure: str, region: str, ring: str, coarser: float, found: Quantities, result: Result, cpu: float
) -> Row:
    soft = [body for body in result.bodies if body.fidelity is Fidelity.DEFORMABLE]
    rigid = sum(body.fidelity is Fidelity.RIGID for body in result.bodies)
    return {
        "structure": structure,
        "region": region,
        "ring": ring,
        "coarser": "–" if ring in ("–", "0") else f"× {coarser:g}",
        "deformable": len(soft),
        "von_mises_mean": found.von_mises_mean,
        "von_mises_p99": found.von_mises_p99,
        "von_mises_max": found.von_mises_max,
        "unknowns": 6 * rigid + 3 * sum(len(body.reference) for body in soft),
        "cpu_s": cpu,
        "outcome": found.outcome,
        "static": result.static is not None and result.static.found,
        "natural_map": found.errors["natural_map"],
    }


def _apart(found: Quantities, reference: Quantities, stones: frozenset[str]) -> Row:
    """Differences in percent: of the region's stress and displacement, of reactions and joint forces everywhere."""
    apart = {name: None if one is None else 100 * one for name, one in differences(found, reference).items()}
    moved, true = (
        np.array([one.stones[code].displacement for code in sorted(stones)]) for one in (found, reference)
    )
    return {
        "mean": apart["von_mises_mean"],
        "p99": apart["von_mises_p99"],
        "max": apart["von_mises_max"],
        "each": apart["stone_von_mises_mean"],
        "reactions": apart["support_reactions"],
        "forces": apart["joint_forces"],
        "moved": 100 * float(np.linalg.norm(moved - true) / np.linalg.norm(true)),
    }


if __name__ == "__main__":
    guarded(main)
