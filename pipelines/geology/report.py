"""report.html of a run of disks: what it measured, how far it can be trusted, its cells, figures and settings."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from archmodel.quantities import quantities_of
from mechanics.arrays import Array
from pipelines.geology.file import GeologyScene
from pipelines.reports.html import kilopascals, percent, picture, ratio, scientific, table_of, write_page
from pipelines.reports.page.model import Model

_CAPTIONS = {
    "layers": "Marker layers, which were level at the start, and the disks of the cells.",
    "velocity": "Velocities of some of the disks.",
    "forces": "Normal forces of the contacts that are pressed; the widest line is the strongest.",
    "trishear": "Velocities beside those of the trishear that comes nearest.",
    "shear": "Local shear since the start: the logarithm of the ratio of the principal stretches.",
    "shapes": "Disks of each cell at the instants of the figures; a row has one scale.",
    "course": "What the experiment observes with time; dashed lines part the phases of the run.",
    "cells": "The cells with time; dashed lines part the phases of the run.",
}
_OUTCOMES = {
    "equilibrium": "At the end all disks rest, in balance.",
    "moving": "At the end of the run disks still move.",
    "interrupted": "It was interrupted before its time.",
}


def write_report(
    path: Path,
    scene: GeologyScene,
    summary: Mapping[str, Any],
    rows: Mapping[str, Mapping[str, Array]],
    model: Model | None = None,
) -> None:
    """Write the page and embed the figures of its folder.

    Parameters
    ----------
    path : report.html
    summary : as in summary.json
    rows : columns by cell; the table shows the last
    model : content of the viewer; None: the page has none
    """
    figures = [
        (one, words) for name, words in _CAPTIONS.items() for one in sorted(path.parent.glob(f"{name}*.png"))
    ]
    write_page(
        path,
        "geology.html",
        model,
        name=summary["scene"],
        lead=f"{summary['disks']} disks, {summary['steps']} steps, {summary['time']['simulated']:g} s of a "
        f"{summary['kind']} scene. {_OUTCOMES[summary['outcome']]} {summary['note']}".strip(),
        cautions=summary["cautions"],
        warnings=summary["warnings"],
        version=summary["version"],
        versions=summary.get("versions"),
        measures=[(name, ratio(value)) for name, value in summary["measures"].items()],
        quality=_quality(summary),
        cells=table_of("cell of disks", list(rows.items()), _cell),
        figures=[picture(path, f"{words} Quality: {summary['headline']}.") for path, words in figures],
        settings=_settings(scene),
    )


def _quality(summary: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    overlap, over_mean, eta = (
        summary[name] for name in ("overlap", "overlap_over_mean_radius", "natural_map")
    )
    values = {
        "overlap.max": (
            f"{overlap['max']:.2%}",
            f"of the smallest radius; {over_mean['max']:.2%} of the mean one",
        ),
        "overlap.mean": (
            f"{overlap['mean']:.3%}",
            f"of the smallest radius; {over_mean['mean']:.3%} of the mean one",
        ),
        "natural_map.median": (scientific(eta["median"]), "of the natural map, over the steps"),
        "natural_map.max": (scientific(eta["max"]), f"the tolerance is {summary['tolerance']:g}"),
        "unconverged_share": (
            percent(summary["unconverged_share"]),
            f"{summary['unconverged_steps']} of {summary['steps']}",
        ),
        "energy": (
            scientific(summary["energy"]),
            "that no term of the balance explains, over the largest in play",
        ),
    }
    quantities = quantities_of("run of disks")
    return [(quantities[name].label, *texts) for name, texts in values.items()]


def _cell(cell: tuple[str, Mapping[str, Array]]) -> dict[str, str]:
    name, columns = cell
    last = {column: float(values[-1]) for column, values in columns.items()}
    return {
        "cell": name,
        **{column: ratio(last[column]) for column in ("lambda_x", "lambda_y")},
        **{column: kilopascals(last[column]) if np.isfinite(last[column]) else "–" for column in ("p", "q")},
        "direction": _degrees(last["direction"]),
        "anisotropy": ratio(last["anisotropy"]),
        "fabric_direction": _degrees(last["fabric_direction"]),
        **{column: ratio(last[column]) for column in ("coordination", "porosity")},
    }


def _degrees(angle: float) -> str:
    return f"{angle:.0f}°" if np.isfinite(angle) else "–"


def _settings(scene: GeologyScene) -> list[tuple[str, str]]:
    layers = {f"layers, {number} from below": layer for number, layer in enumerate(scene.layers, start=1)}
    return [
        (name, ", ".join(f"{key} = {value}" for key, value in asdict(table).items() if value is not None))
        for name, table in {**scene.tables, **layers}.items()
    ]
