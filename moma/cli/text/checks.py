"""Findings of `moma check` as text."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from moma.cli.text.formats import shorten

if TYPE_CHECKING:
    from pipelines.run.check_report import CheckReport, Cost, MeshQualityReport
    from pipelines.run.closing_check import GapPlace, JointsReport, SimplificationReport

_SHOWN = 5
"""Number of stones and places listed without -v."""

_NAMES = {
    "hexahedron": ("hexahedron", "hexahedra"),
    "wedge": ("wedge", "wedges"),
    "prism": ("prism", "prisms"),
    "polyhedron": ("general polyhedron", "general polyhedra"),
}
"""Singular and plural of each shape."""

_NOTHING = 5e-5
"""Smaller movements are rounding [m]."""


def check_lines(report: "CheckReport", verbose: bool, explain: bool = False) -> list[str]:
    """Describe a scene: plan, stones, joints, cost and problems; with `explain`, the model of each stone."""
    lines = [
        f"{report.scene}: {sum(report.kinds.values())} stones "
        f"({', '.join(f'{count} {kind}' for kind, count in report.kinds.items())})",
        *(f"  caution: {caution}" for caution in report.cautions),
        f"  models: {', '.join(f'{count} {name}' for name, count in report.bodies.items())}",
        *_stress_lines(report),
        *(_explanation(report) if explain else []),
        *(
            f"  material {material.name}: {material.stones} stones, ρ {material.density:g} kg/m³, "
            f"E {material.young / 1e9:g} GPa, ν {material.poisson:g}"
            for material in report.materials
        ),
    ]
    lines += [f"  mesh {mesh.element}, {mesh.size:g} m: {mesh.stones} stones" for mesh in report.meshes]
    if report.mesh_quality is not None:
        lines += _mesh_lines(report.mesh_quality)
    lines += [f"  law {law}" for law in report.laws] + [f"  load {load}" for load in report.loads]
    lines += [f"  stage {stage}" for stage in report.stages]
    if report.simplification is not None:
        lines += _simplification_lines(report.simplification, verbose)
    if report.joints is not None:
        lines += _joint_lines(report.joints, verbose)
    if report.filling is not None:
        lines.append(f"  {report.filling.in_words()}")
    if report.cost is not None:
        cost = report.cost
        lines += [
            f"  {cost.pairs} touching pairs, {cost.contacts} contact points at the start",
            *(
                [
                    f"    {cost.open_pairs} of them open by up to {1e3 * cost.widest:.2g} mm: a run moves stones until "
                    "they close; limit loads count gaps of up to a thousandth of a stone's width as closed"
                ]
                if cost.open_pairs
                else []
            ),
            f"  {cost.unknowns} unknowns, about {max(1, round(cost.memory / 2**20))} MiB of arrays",
            f"  at most {cost.steps} steps of {cost.step:g} s",
            _expected(cost),
        ]
    lines += [f"problem: {problem}" for problem in report.problems]
    if not report.problems:
        lines.append("; but ".join(["sound: it can be run", *report.cautions[:1]]))
    return lines


def _expected(cost: "Cost") -> str:
    """Describe the expected time and memory, and say where the time cannot be known."""
    low, likely, high = map(duration, cost.seconds)
    memory = f"{max(1, round(cost.peak / 2**20))} MiB in all"
    if cost.unknown:
        return (
            f"  expected: {likely} of one processor if all goes well, but from {low} to {high} are possible: "
            f"{cost.unknown}; {memory}"
        )
    return f"  expected: {likely} of one processor ({low} to {high}), {memory}"


def _stress_lines(report: "CheckReport") -> list[str]:
    """Count the stones whose stress is computed, if only some of the moving stones deform."""
    asked = sum(stone.stress for stone in report.stones)
    if not report.bodies["deformable"] or (not report.bodies["rigid"] and not report.ring):
        return []
    ring = f"; {report.ring} around them deform too" if report.ring else ""
    return [f"  stress of {_count(asked, 'stone')}{ring}"]


def _explanation(report: "CheckReport") -> list[str]:
    """List each stone's model and the reason for it, in columns."""
    wide = max(len(stone.code) for stone in report.stones)
    return [f"    {stone.code:{wide}}  {stone.fidelity:10}  {stone.reason}" for stone in report.stones]


def _mesh_lines(quality: "MeshQualityReport") -> list[str]:
    how = ", ".join(f"{count} {name}" for name, count in quality.how.items())
    lines = [
        f"  {quality.nodes} nodes, {quality.cells} cells in {quality.distinct} different meshes ({how}); smallest "
        f"angle {quality.smallest_angle:.0f}° (stone {quality.sharpest}), smallest scaled Jacobian "
        f"{quality.smallest_jacobian:.2f} (stone {quality.worst})"
    ]
    return lines + [f"  stone {code}: {'; '.join(failures)}" for code, failures in quality.retried.items()]


def _simplification_lines(report: "SimplificationReport", verbose: bool) -> list[str]:
    """Describe the simplified stones, and list those outside the survey's tolerance."""
    shapes = ", ".join(f"{count} {_NAMES[shape][count != 1]}" for shape, count in report.shapes.items())
    line = f"  simplified: {shapes}"
    if report.max_displacement > _NOTHING:
        line += f"; corners moved by {_mm(report.max_displacement)} at most (stone {report.worst_stone})"
    if report.blockiness < 1.0 - _NOTHING:
        line += f"; least blocky {report.least_blocky} ({report.blockiness:.2f})"
    lines = [line]
    outside = [
        f"    {stone.code}: moved by {_mm(stone.displacement)}, the survey is good to {_mm(stone.tolerance)}; "
        f"{stone.reason}"
        for stone in report.outside
    ]
    if outside:
        lines.append(f"  {_count(len(outside), 'stone')} outside the survey's tolerance:")
        lines += _shortened(outside, verbose)
    general = [f"    {code}: {reason}" for code, reason in report.general.items()]
    if general:
        lines.append(f"  {_count(len(general), 'stone')} of general shape:")
        lines += _shortened(general, verbose)
    if verbose:
        moved = {code: distance for code, distance in report.displacement.items() if distance > _NOTHING}
        lines += [f"    {code} simplified by {_mm(distance)}" for code, distance in moved.items()]
    return lines


def _joint_lines(report: "JointsReport", verbose: bool) -> list[str]:
    """Describe the joints, and list gaps and overlaps."""
    left, as_surveyed = sum(report.left_open.values()), report.mode == "as-surveyed"
    in_part = sum(gap.reason not in report.left_open for gap in report.gaps)
    touching = sum(gap.reason not in report.left_open and gap.width <= _NOTHING for gap in report.gaps)
    partly = f" ({touching} of them on less than half of their area)" if touching else ""
    lines = [
        f"  joints ({report.mode}): {left} left as they are, {_mm(report.mean_width)} wide on average"
        if as_surveyed
        else f"  joints ({report.mode}): {report.count} closed{partly} on {report.planes} planes, "
        f"{report.area:.2f} m² in all; {_mm(report.mean_width)} wide on average as surveyed; {left} left open"
    ]
    if report.count and report.worst_stone is not None:
        lines.append(
            f"  closing moved corners by {_mm(report.max_displacement)} at most (stone {report.worst_stone}), "
            f"and changed volumes by {100 * report.max_volume_change:.1f} % at most"
        )
    lines += [f"  {line}" for leaf in report.leaves for line in leaf.in_words()]
    into = [
        f"    {' and '.join(pair.stones)} were measured {_mm(-pair.width)} into each other at {_place(pair.place)}"
        for pair in report.measured_overlaps
    ]
    if into:
        many = _count(len(into), "joint")
        lines += [f"  {many} closed half-way between overlapping stones; check their corners:"]
        lines += _shortened(into, verbose)
    overlaps = [
        f"    {' and '.join(overlap.stones)} lie {_mm(overlap.depth)} in each other ({overlap.volume * 1e6:.3g} cm³) "
        f"at {_place(overlap.place)}"
        for overlap in report.overlaps
    ]
    if overlaps:
        lines += [f"  {_count(len(overlaps), 'overlap')} left:", *_shortened(overlaps, verbose)]
    gaps = [
        f"    {' and '.join(gap.stones)} {_apart(gap)} at {_place(gap.place)}"
        + ("" if as_surveyed else f": {gap.reason}")
        for gap in report.gaps
    ]
    if gaps:
        left_by = ", the largest first:" if len(gaps) > 1 else ":"
        these = f" ({in_part} in joints that are closed on less than half of their area)" if in_part else ""
        lines += [f"  {_count(len(gaps), 'gap')} left{these}{left_by}", *_shortened(gaps, verbose)]
    if report.alone:
        some = ", ".join(report.alone[:_SHOWN]) + (", …" if len(report.alone) > _SHOWN else "")
        lines.append(f"  {_count(len(report.alone), 'stone')} without any joint: {some}")
    if verbose:
        moved = {code: distance for code, distance in report.displacement.items() if distance > _NOTHING}
        lines += [f"    {code} moved by {_mm(distance)}" for code, distance in moved.items()]
    return lines


def _apart(gap: "GapPlace") -> str:
    """Return how far two stones are apart; those drawn without a gap touch in a part of their faces alone."""
    if gap.width > _NOTHING:
        return f"open by {_mm(gap.width)} over {gap.area:.3f} m²"
    return f"touch on less than half of {gap.area:.3f} m²"


def _shortened(lines: Sequence[str], verbose: bool) -> list[str]:
    """Return the first lines, and the number of the others."""
    return list(lines) if verbose else shorten(lines, _SHOWN, "    ", ", with -v")


def duration(seconds: float) -> str:
    """Format a time in its natural unit, to two digits."""
    value, unit = seconds, "s"
    for step, longer in ((60.0, "min"), (60.0, "h"), (24.0, "days")):
        if value < 2.0 * step:
            break
        value, unit = value / step, longer
    return f"{value:.0f} {unit}" if value >= 10.0 else f"{value:.2g} {unit}"


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def _mm(length: float) -> str:
    return f"{length * 1e3:z.1f} mm"


def _place(place: tuple[float, float, float]) -> str:
    return f"({', '.join(f'{coordinate:z.3f}' for coordinate in place)})"
