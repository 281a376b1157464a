"""Outcome of `moma record` as text."""

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


if TYPE_CHECKING:
    from archmodel.store.revisions import RowCounts
    from pipelines.record.record import RecordReport


def record_lines(report: "RecordReport", verbose: bool) -> list[str]:
    """Describe the outcome of each file; with `verbose`, of each of its arrays of tables."""
    lines = []
    would = " (dry run: nothing was kept)" if report.dry_run else ""
    for file in report.files:
        before = ""
        if file.recorded_before is not None:
            before = f"recorded before, as entry {file.recorded_before}; "
        notes = [f"  {note}" for note in file.notes]
        if before and not file.entries:
            lines.append(f"{file.path}: {before}nothing changed")
            continue
        if not file.entries:
            lines += [f"{file.path}: all of it was known; nothing changed", *notes]
            continue
        numbers = ", ".join(map(str, file.entries))
        noun = "entry" if len(file.entries) == 1 else "entries"
        again = "what was withdrawn since is stated again: " if before else ""
        lines.append(f"{file.path}: {before}{again}{_counts(file.outcome)}, as {noun} {numbers}{would}")
        lines += notes
        if verbose or report.dry_run:
            lines += [f"  {name}: {_counts(outcome)}" for name, outcome in file.tables.items()]
        lines += [
            f"  document {attachment.document}: {attachment.place} is not there, and is taken to be elsewhere"
            for attachment in file.attachments
            if attachment.sha256 is None
        ]
    if report.related is not None:
        lines.append(f"relations of the corrected stones recomputed, as entry {report.related}")
    return lines


def _counts(outcome: "RowCounts") -> str:
    """Format the counts that are not zero."""
    counts = {
        "new": outcome.new,
        "replaced": outcome.replaced,
        "withdrawn": outcome.withdrawn,
        "unchanged": outcome.unchanged,
    }
    return ", ".join(f"{count} {name}" for name, count in counts.items() if count) or "nothing"
