"""Rounded assemblies of solids: `python -m benchmarks.assemblies --case FILE SNAP SUPPORT [--case …] [--json]`.

Each file (OBJ, PLY, STL, MSH) is read, snapped within SNAP metres, cut into convex parts, and simulated as rigid
stones on those whose lowest corner is below SUPPORT metres, with friction 0.7, until it rests; from rest, or with
--static from its static equilibrium. Overlaps are those of the convex parts, found by what looks for them in closed
walls, and not by what snaps.
"""

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.report import Row, Table, environment, guarded, machine, print_json, print_table, progress
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import Block, ContactSettings, Fidelity, Part, Scene, Start, TimeSettings
from mechanics.simulate import simulate
from mechanics.stones.materials import Material
from survey.formats.options import ReadingOptions
from survey.formats.solids.reader import open_solids
from survey.geometry.convex_parts import convex_parts
from survey.geometry.solids import Solid, planes_of_solid
from survey.joints.overlaps import find_overlaps
from survey.joints.snapping.matching_faces import find_matches
from survey.joints.snapping.snapping import snap
from survey.records.survey import Reject

__all__ = ["main"]

_STONE = Material("stone", density=2000.0, young=12e9, poisson=0.2)
_GEOMETRY: Table = (
    ("file", "file", ""),
    ("stones", "stones", "d"),
    ("not_convex", "not convex", "d"),
    ("parts", "parts", "d"),
    ("contacts", "contacts", "d"),
    ("planes", "planes", "d"),
    ("left_open", "left open", "d"),
    ("before", "out of plane before mm", ".2f"),
    ("after", "after m", ".0e"),
    ("moved", "largest movement mm", ".2f"),
    ("area", "area kept", ".3%"),
    ("overlap", "largest overlap m³", ".0e"),
    ("snap_s", "snapping s", ".2f"),
    ("part_ms", "parts of a stone ms", ".1f"),
)
_MECHANICS: Table = (
    ("file", "file", ""),
    ("supports", "supports", "d"),
    ("outcome", "outcome", ""),
    ("displacement", "displacement m", ".0e"),
    ("balance", "balance", ".0e"),
    ("reaction", "reaction", ".0e"),
    ("penetration", "penetration", ".0e"),
    ("steps", "steps", "d"),
    ("unsolved", "unsolved", "d"),
    ("compliant", "with compliant joints", "d"),
    ("run_s", "run s", ".1f"),
    ("per_200", "s per 200 stones", ".1f"),
)


def main() -> None:
    """Run all cases and print."""
    parser = argparse.ArgumentParser(prog="benchmarks.assemblies", description=__doc__)
    parser.add_argument(
        "--case", nargs=3, action="append", required=True, metavar=("FILE", "SNAP", "SUPPORT")
    )
    parser.add_argument("--unit", type=float, default=1.0, help="of all files [m]")
    parser.add_argument("--static", action="store_true", help="begin in the static equilibrium")
    parser.add_argument("--json", action="store_true", help="print JSON")
    options = parser.parse_args()
    rows = []
    for file, tolerance, support in options.case:
        progress(file)
        start = Start.EQUILIBRIUM if options.static else Start.REST
        rows.append(_row(Path(file), float(tolerance), float(support), options.unit, start))
    if options.json:
        print_json(rows)
        return
    print(f"{machine()}; {environment('numpy', 'scipy', 'numba')}\n")
    for table in (_GEOMETRY, _MECHANICS):
        print_table(rows, table)
        print()


def _row(path: Path, tolerance: float, support: float, unit: float, begin: Start) -> Row:
    given = _solids(path, ReadingOptions(unit=unit, flat=tolerance))
    find_matches(given, tolerance)  # compiles
    start = time.process_time()
    solids, snapping = snap(given, tolerance)
    spent = time.process_time() - start
    size = max(float(np.ptp(one.vertices, axis=0).max()) for one in solids)
    before = [one for one in find_matches(given, tolerance) if one.area > 0.0]
    after = [one for one in find_matches(solids, 1e-9 * max(1.0, size)) if one.area > 0.0]
    start = time.process_time()
    parts = [convex_parts(one) for one in solids]
    cutting = time.process_time() - start
    folded = sum(len(one) > 1 for one in parts)
    return {
        "file": path.name,
        "stones": len(solids),
        "not_convex": folded,
        "parts": sum(map(len, parts)),
        "contacts": snapping.contacts,
        "planes": snapping.planes,
        "left_open": len(snapping.left_open),
        "before": 1e3 * max(one.spread for one in before),
        "after": max(one.spread for one in after),
        "moved": 1e3 * snapping.largest_movement,
        "area": sum(one.area for one in after) / sum(one.area for one in before),
        "overlap": _largest_overlap(parts),
        "snap_s": spent,
        "part_ms": 1e3 * cutting / folded if folded else None,
        **_mechanics(path.name, solids, parts, support, begin),
    }


def _solids(path: Path, options: ReadingOptions) -> list[Solid]:
    """The stones with their corners where the file has them."""
    out = []
    for one in open_solids(path, options).blocks:
        if isinstance(one, Reject):
            raise one.error
        out.append(Solid(one.code, one.vertices, one.faces))  # type: ignore[union-attr]
    return out


def _largest_overlap(parts: Sequence[Sequence[Solid]]) -> float:
    """Of two stones [m³]; the parts of one stone are no two stones."""
    every = [one for own in parts for one in own]
    stone = [k for k, own in enumerate(parts) for _ in own]
    common: dict[tuple[int, int], float] = {}
    for one in find_overlaps(every, {k: planes_of_solid(part) for k, part in enumerate(every)}):
        pair = stone[one.pair[0]], stone[one.pair[1]]
        if pair[0] != pair[1]:
            common[pair] = common.get(pair, 0.0) + one.volume
    return max(common.values(), default=0.0)


def _mechanics(
    name: str, solids: Sequence[Solid], parts: Sequence[Sequence[Solid]], support: float, begin: Start
) -> Row:
    blocks = tuple(_block(one, own, support) for one, own in zip(solids, parts, strict=True))
    scene = Scene(
        name,
        blocks,
        contact=ContactSettings(law=DryJoint(friction=0.7)),
        time=TimeSettings(step=0.01, duration=0.5, relaxation=True, start=begin),
    )
    simulate(replace(scene, time=replace(scene.time, duration=scene.time.step)))  # compiles
    start = time.process_time()
    result = simulate(scene)
    spent, held = time.process_time() - start, sum(block.fidelity is Fidelity.FIXED for block in blocks)
    compliant = sum(steps for why, steps in result.solvers.items() if why.startswith("compliant joints"))
    return {
        "supports": held,
        "outcome": str(result.outcome),
        "displacement": max(float(np.abs(one.position - one.reference).max()) for one in result.bodies),
        "balance": result.errors.balance,
        "reaction": result.errors.reaction,
        "penetration": result.errors.penetration,
        "steps": result.steps,
        "unsolved": result.errors.unconverged_steps,
        "compliant": compliant,
        "run_s": spent,
        "per_200": 200.0 * spent / (len(blocks) - held),
    }


def _block(solid: Solid, parts: Sequence[Solid], support: float) -> Block:
    fixed = float(solid.vertices[:, 2].min()) < support
    return Block(
        solid.code,
        solid.vertices,
        solid.faces,
        _STONE,
        Fidelity.FIXED if fixed else Fidelity.RIGID,
        parts=tuple(Part(one.vertices, one.faces) for one in parts) if len(parts) > 1 else (),
    )


if __name__ == "__main__":
    guarded(main)
