"""Stratigraphy as text."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pipelines.draw.stratigraphy.matrix import Matrix

SHOWN = 40
"""Units that are listed; with `verbose` all."""


def matrix_lines(report: "Matrix", verbose: bool) -> list[str]:
    """Describe contradictions first, then the units from the latest to the earliest."""
    order, count = report.order, len(report.contradictions)
    head = f"{count} contradictions of matrix and dates" if count else "matrix and dates agree"
    lines = [
        f"{head}: {sum(map(len, order.equal.values()))} units, {len(report.links)} relations, of which "
        f"{order.redundant} are implied by others"
    ]
    lines += [f"  {contradiction.text}" for contradiction in report.contradictions]
    units = sorted(order.units, key=lambda unit: -order.levels[unit])
    for unit in units if verbose else units[:SHOWN]:
        years = report.bounds[unit]
        dates = [
            f"not before {years.begins} ({years.begins_by})" if years.begins is not None else "",
            f"not after {years.ends} ({years.ends_by})" if years.ends is not None else "",
        ]
        below = f"later than {', '.join(order.below[unit])}" if order.below[unit] else ""
        details = "; ".join(filter(None, (below, *dates)))
        lines.append(
            f"level {order.levels[unit]}: {' = '.join(order.equal[unit])}{details and f': {details}'}"
        )
    if not verbose and len(units) > SHOWN:
        lines.append(f"{len(units) - SHOWN} more units; all by --verbose")
    return lines
