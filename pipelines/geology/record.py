"""Database record of a run of disks."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from archmodel.store.run_record import RunRecord
from mechanics.arrays import Array
from mechanics.planar.result import PlanarResult
from pipelines.geology.file import GeologyScene
from pipelines.run.record import error_measures, versions

__all__ = ["geology_record"]


def geology_record(
    scene: GeologyScene,
    result: PlanarResult,
    summary: Mapping[str, Any],
    rows: Mapping[str, Mapping[str, Array]],
) -> RunRecord:
    """Return the record of a run: settings, quality, measures, and the rows of its cells.

    Parameters
    ----------
    summary : the contents of summary.json
    rows : columns by cell
    """
    return RunRecord(
        scene=scene.name,
        scene_text=scene.text,
        outcome=str(result.outcome),
        summary=summary,
        versions=versions(),
        results=(),
        settings={
            "kind": scene.kind,
            **{name: asdict(table) for name, table in scene.tables.items()},
            "layers": [asdict(layer) for layer in scene.layers],
        },
        steps=result.steps,
        simulated=result.time,
        wall=summary["time"]["wall"],
        errors=error_measures(result.errors),
        cells=rows,
    )
