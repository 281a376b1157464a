"""Peaks of a run in words."""

from collections.abc import Mapping
from typing import Any

from archmodel.quantities import quantities_of
from pipelines.reports.html import Table, in_words, table_of
from survey.conventions import FEW, PER_MILLE

PASSED = 1.0 + FEW  # peak over the value at the end, from which the end says too little [-]
_NO_FORCE = PER_MILLE  # of the weight [-]: a smaller reaction is not worth a line


def passed_peaks(summary: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the peaks that exceed the value at the end by more than a twentieth, and any tolerance, by name."""
    known, least = _distinct(summary), summary["tolerance"]["length"]
    return {
        name: one
        for name, one in known.items()
        if one["value"] > PASSED * max(one["end"], 0.0) and one["value"] > _least(one, summary, least)
    }


def peak_text(peak: Mapping[str, Any], least: float) -> str:
    """Describe a peak: its value, time and stones, and the value at the end; lengths below `least` [m] as such."""
    value, when, where, end = _cells(peak, least)
    return f"{value} after {when}{f', {where}' if where else ''}; {end} at the end"


def peak_table(summary: Mapping[str, Any]) -> Table:
    """Return the table of all peaks."""
    least, labels = summary["tolerance"]["length"], quantities_of("peak")

    def cells(peak: tuple[str, Mapping[str, Any]]) -> dict[str, str]:
        """Return the texts of a peak."""
        names = ("quantity", "value", "time", "stones", "end")
        return dict(zip(names, (labels[peak[0]].label, *_cells(peak[1], least)), strict=True))

    return table_of("peak in summary.json", list(_distinct(summary).items()), cells)


def _distinct(summary: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the peaks that are known; relative displacements only where the supports move."""
    known = {name: peak for name, peak in summary["peaks"].items() if peak is not None}
    if known.get("displacement") == known.get("relative_displacement"):
        known.pop("relative_displacement", None)
    return known


def _cells(peak: Mapping[str, Any], least: float) -> tuple[str, str, str, str]:
    """Return the value, the time, the stone or joint, and the value at the end."""
    value, end = (in_words(peak[key], peak["unit"], least) for key in ("value", "end"))
    if peak["unit"] == "m" and peak["value"] < least:
        return value, "–", "–", end
    return value, f"{peak['time']:.4g} s", " – ".join(peak["stones"]), end


def _least(peak: Mapping[str, Any], summary: Mapping[str, Any], length: float) -> float:
    """Return the least value that is worth a line."""
    return {"m": length, "N": _NO_FORCE * float(summary["reaction"]["weight"])}.get(peak["unit"], 0.0)
