"""Result files of a tradeoff study: trade.json, trade.csv, trade.png."""

import csv
import io
import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from typing import Any

from mechanics.scene.scene import Fidelity
from pipelines.results.quantities import QUANTITIES
from pipelines.results.summary import as_json
from pipelines.tradeoff.forecast import Forecast, left_out
from pipelines.tradeoff.pareto import ErrorReference, Judged, cheapest, counted, front, judge
from pipelines.tradeoff.plot import Panel, Point, trade_png
from pipelines.tradeoff.scheduler import Limits
from pipelines.tradeoff.store import INDEX, Measured, Status, Store
from pipelines.tuning.overlay import overlay_record, scene_lines

MAIN = (
    *("von_mises_p99", "von_mises_max", "stone_von_mises_mean", "support_reactions", "joint_forces"),
    "displacement",
)
"""Quantities that table and plot show where they are known."""

_COSTS = ("cpu", "wall", "memory", "nodes", "contacts", "steps", "unconverged_steps", "solver")


@dataclass(frozen=True)
class Goal:
    """Goal of a study.

    Attributes
    ----------
    scene : its title
    quantity : by which settings are judged
    error : below which a setting is recommended [-]
    width : typical smallest width of the stones [m]
    """

    scene: str
    quantity: str
    error: float
    width: float


def study_record(goal: Goal, forecast: Forecast, left: float, limits: Limits) -> dict[str, Any]:
    """Return the contents of trade.json: every setting with its cost and errors, or the reason for having no result."""
    reference, judged = judge(forecast.settings, forecast.ended)
    quantity = goal.quantity
    points = [(entry.run.cpu, error) for entry in judged if (error := counted(entry, quantity)) is not None]
    names = [entry.run.name for entry in judged if counted(entry, quantity) is not None]
    best = {names[number] for number in front(points)}
    rows = [_row(entry) | {"front": entry.run.name in best} for entry in judged]
    rows.sort(key=lambda row: row["cpu"])
    for name, setting in forecast.settings.items():
        run = forecast.ended.get(name)
        if run is None:
            reason = left_out(forecast, setting, left, limits.memory / limits.jobs)
            run = Measured(name, setting.overlay, Status.NOT_BEGUN, 0.0, limits.budget, reason)
        if run.status is not Status.DONE:
            rows.append(_row(Judged(run, {})) | {"front": False})
    return {
        "scene": goal.scene,
        "version": version("moma-masonry"),
        "machine": {"processor": platform.processor() or platform.machine(), "cores": os.cpu_count()},
        "budget": limits.budget,
        "jobs": limits.jobs,
        "spent": sum(run.elapsed for run in forecast.ended.values()) / limits.jobs,
        "quantities": dict(QUANTITIES),
        "quantity": quantity,
        "asked_error": goal.error,
        "reference": None if reference is None else asdict(reference),
        "rows": rows,
        "recommended": _recommended(goal, reference, judged, forecast.ended),
        "files": ["trade.csv", "trade.json", *(["trade.png"] if reference is not None else [])],
    }


def write_study(store: Store, record: Mapping[str, Any]) -> None:
    """Write the files of a study; each appears whole or not at all, the index last."""
    store.write("trade.csv", _as_csv(record["rows"]).encode("utf-8"))
    if record["reference"] is not None:
        store.write("trade.png", study_png(record))
    store.write(INDEX, as_json(record).encode("utf-8"))


def _row(judged: Judged) -> dict[str, Any]:
    run = judged.run
    return {
        "setting": run.name,
        "overlay": overlay_record(run.overlay),
        "status": str(run.status),
        "reason": run.reason,
        "elapsed": run.elapsed,
        **{name: getattr(run, name) for name in _COSTS},
        "outcome": None if run.quantities is None else run.quantities.outcome,
        "stress_error": None if run.quantities is None else run.quantities.stress_error,
        "errors": dict(judged.errors),
    }


def _recommended(
    goal: Goal,
    reference: ErrorReference | None,
    judged: Sequence[Judged],
    runs: Mapping[str, Measured],
) -> dict[str, Any] | None:
    recommendation = None if reference is None else cheapest(judged, reference, goal.quantity, goal.error)
    if recommendation is None:
        return None
    run = runs[recommendation.name]
    return {
        "setting": recommendation.name,
        "error": recommendation.error,
        "holds": recommendation.holds,
        "cpu": run.cpu,
        "lines": scene_lines(run.overlay, goal.width),
    }


def _as_csv(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return one line for each setting, with empty fields for unknown values."""
    plain = [name for name in rows[0] if name not in ("overlay", "errors")]
    out = io.StringIO()
    writer = csv.DictWriter(
        out, [*plain, *(f"error_{name}" for name in QUANTITIES)], extrasaction="ignore", lineterminator="\n"
    )
    writer.writeheader()
    for row in rows:
        writer.writerow({**row, **{f"error_{name}": value for name, value in row["errors"].items()}})
    return out.getvalue()


def study_png(record: Mapping[str, Any]) -> bytes:
    """Draw the picture of a study from the contents of its trade.json."""
    title = f"{record['scene']}: error against the finest affordable run ({record['reference']['name']})"
    title = "\n".join([title, *record["cautions"]])
    return trade_png(title, _panels(record), record["asked_error"])


def _panels(record: Mapping[str, Any]) -> list[Panel]:
    """Return a panel for each main quantity that at least two runs have, the requested one first."""
    done = [row for row in record["rows"] if row["status"] == Status.DONE and not row["errors"]["outcome"]]
    reference, panels = record["reference"], []
    for quantity in dict.fromkeys([record["quantity"], *MAIN]):
        rows = [row for row in done if row["errors"][quantity] is not None]
        if len(rows) < 2:
            continue
        points = [Point(row["setting"], _kind(row), row["cpu"], row["errors"][quantity]) for row in rows]
        recommended = record["recommended"] if quantity == record["quantity"] else None
        panels.append(
            Panel(
                title=QUANTITIES[quantity],
                points=tuple(points),
                front=front((point.cpu, point.error) for point in points),
                reference=reference["name"],
                reference_error=reference["errors"][quantity],
                recommended=None if recommended is None else recommended["setting"],
            )
        )
    return panels


def _kind(row: Mapping[str, Any]) -> str:
    """Return the kind by which a point of the plot is coloured."""
    overlay = row["overlay"]
    if overlay.get("fidelity") == Fidelity.RIGID:
        return str(Fidelity.RIGID)
    return str(overlay.get("element") or overlay.get("fidelity") or "as written")
