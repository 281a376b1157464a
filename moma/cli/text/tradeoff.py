"""Findings of `moma trade` as text."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from moma.cli.text.formats import as_table

if TYPE_CHECKING:
    from pipelines.tradeoff.study import TradeReport

_COLUMNS = (
    *("von_mises_p99", "von_mises_max", "stone_von_mises_mean", "support_reactions", "joint_forces"),
    "displacement",
)


def trade_lines(report: "TradeReport", verbose: bool) -> list[str]:
    """Describe a study: table, reference, recommendation and files."""
    record = report.record
    rows = record["rows"]
    done = [row for row in rows if row["status"] == "done"]
    lines = [
        f"{record['scene']}: {len(done)} of {len(rows)} settings run, {record['spent']:.0f} s of "
        f"{record['budget']:.0f} s spent",
        *(f"  caution: {caution}" for caution in record["cautions"]),
    ]
    if done:
        lines += [
            "",
            *_table(record, done).splitlines(),
            "",
            *_reference_lines(record),
            *_advice_lines(record),
        ]
    lines += _other_lines([row for row in rows if row["status"] != "done"], verbose)
    return [*lines, *(f"  {report.folder / name}" for name in record["files"])]


def _table(record: Mapping[str, Any], done: Sequence[Mapping[str, Any]]) -> str:
    """Tabulate costs and errors of the completed runs; mark the Pareto front; estimate the reference's errors."""
    asked = dict.fromkeys([record["quantity"], *_COLUMNS])
    shown = [name for name in asked if any(row["errors"][name] is not None for row in done)]
    columns = {"": None, "setting": None, "CPU": "s", "wall": "s", "memory": "MiB", "nodes": None}
    columns |= {"outcome": None} if len({row["outcome"] for row in done}) > 1 else {}
    columns |= dict.fromkeys(shown, "%") | {"η": None}
    cells = [
        {
            "": "*" if row["front"] else "",
            "setting": row["setting"] + (" (reference)" if _is_reference(record, row) else ""),
            "CPU": _digits(row["cpu"], 3),
            "wall": _digits(row["wall"], 3),
            "memory": round(row["memory"] / 2**20),
            "nodes": row["nodes"] or None,
            "outcome": row["outcome"],
            "η": _digits(row["errors"]["natural_map"], 2),
            **{name: _percent(row["errors"][name]) for name in shown},
        }
        for row in done
    ]
    return as_table(columns, cells)


def _reference_lines(record: Mapping[str, Any]) -> list[str]:
    reference, quantity = record["reference"], record["quantity"]
    lines = [
        f"reference: {reference['name']}, the finest that was affordable; its own error is not known, only estimated"
    ]
    error = reference["errors"][quantity]
    if error is not None and reference["partner"]:
        lines.append(
            f"  {_percent(error):g} % of {quantity}, by its difference to {reference['partner']!r}, which is "
            f"{reference['ratio']:.3g} times as coarse"
        )
    if reference["stress_error"] is not None:
        lines.append(
            f"  {100 * reference['stress_error']:.1f} % of the stress in the energy norm (Zienkiewicz-Zhu)"
        )
    return lines


def _advice_lines(record: Mapping[str, Any]) -> list[str]:
    advice, asked = record["recommended"], record["asked_error"]
    quantity = record["quantity"]
    if advice is None:
        return [
            f"no recommendation: no run has a known error of {quantity}; try another --of, or allow more --budget"
        ]
    bound = f"{_percent(advice['error']):g} %"
    if advice["holds"]:
        lines = [
            f"recommended: {advice['setting']}, {advice['cpu']:.3g} s of CPU time, {quantity} within {bound} "
            f"({100 * asked:g} % asked; the reference's own error included)"
        ]
    else:
        lines = [
            f"no setting is known to be within {100 * asked:g} % of {quantity}; nearest, within {bound}: "
            f"{advice['setting']}; allow more --budget for a finer reference"
        ]
    if not advice["lines"]:
        return [*lines, "  the scene needs no change"]
    return [*lines, "  in the scene:", *(f"    {line}".rstrip() for line in advice["lines"].splitlines())]


def _other_lines(rows: Sequence[Mapping[str, Any]], verbose: bool) -> list[str]:
    """List the settings without a result, with reasons; without -v only those that were begun."""
    shown = [row for row in rows if verbose or row["status"] != "not begun"]
    lines = [f"{row['status']}: {row['setting']}: {row['reason']}" for row in shown]
    if rest := len(rows) - len(shown):
        lines.append(f"{rest} more settings were not begun; -v gives the reasons")
    return lines


def _is_reference(record: Mapping[str, Any], row: Mapping[str, Any]) -> bool:
    return bool(row["setting"] == record["reference"]["name"])


def _percent(value: float | None) -> float | None:
    return None if value is None else _digits(100.0 * value, 3)


def _digits(value: float | None, digits: int) -> float | None:
    return None if value is None else float(f"{value:.{digits}g}")
