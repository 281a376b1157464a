"""Report of `moma orient` as text."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from moma.cli.text.formats import shorten

if TYPE_CHECKING:
    from pipelines.orient.orient import OrientReport


def orient_lines(report: "OrientReport", verbose: bool) -> list[str]:
    """Describe cameras, photographs, control points and suspected marks."""
    values = report.values
    marks = values["marks"]
    lines = [
        f"{values['name']}: {len(values['photos'])} photographs, {len(values['points'])} points, "
        f"{len(marks['x'])} marks",
        f"  {values['observations']} observations, {values['unknowns']} unknowns, redundancy {values['redundancy']}"
        + ("" if values["sigma0"] is None else f", σ₀ {values['sigma0']:.6g}"),
        f"  datum: {_datum(values)}",
    ]
    for camera in values["cameras"]:
        estimated = [
            (name, parameter) for name, parameter in camera["parameters"].items() if parameter["sigma"]
        ]
        if estimated:
            lines.append(f"  camera {camera['name']} ({camera['model']} distortion):")
            lines += [
                f"    {name} {parameter['value']:.8g} ± {parameter['sigma']:.3g}"
                for name, parameter in estimated
            ]
    photos = [
        f"    {photo['name']}: {photo['marks']} marks, rms {photo['rms'] or 0.0:.2f} px, station ± "
        f"{1e3 * max(photo['sigma'][axis] for axis in 'xyz'):.1f} mm"
        for photo in values["photos"]
    ]
    lines += ["  photographs:", *(photos if verbose else shorten(photos, 12, "    ", ", with -v"))]
    for use in ("weighted", "check"):
        ones = [point for point in values["control"] if point["use"] == use]
        if ones:
            worst = max(ones, key=lambda point: point["test"])
            what = "control" if use == "weighted" else "check"
            lines.append(
                f"  {len(ones)} {what} points; farthest off is {worst['id']}, by {worst['test']:.1f} σ"
            )
    if values["lengths"]:
        worst = max(values["lengths"], key=lambda line: line["test"])
        lines.append(
            f"  {len(values['lengths'])} observations of scale bars and plumb lines; farthest off is {worst['kind']} "
            f"{'–'.join(worst['points'])}, by {1e3 * worst['residual']:z.2f} mm, {worst['test']:.1f} σ"
        )
    suspected = sorted(
        (k for k, verdict in enumerate(marks["verdict"]) if verdict), key=lambda k: -(marks["test"][k] or 0.0)
    )
    if suspected:
        lines.append(f"  {len(suspected)} mark{'' if len(suspected) == 1 else 's'} suspected or left out:")
        ones = [
            f"    point {marks['point'][k]} on {marks['photo'][k]}, line {marks['line'][k]}: "
            f"{marks['test'][k] or 0.0:.1f} σ" + (", left out" if marks["verdict"][k] == "removed" else "")
            for k in suspected
        ]
        lines += ones if verbose else shorten(ones, 5, "    ", ", with -v")
    lines.append(f"  results in {report.folder}")
    return lines


def _datum(values: Mapping[str, Any]) -> str:
    """Describe what place, orientation and scale come from."""
    if values["datum"] == "control":
        return "control points, or observed stations and angles"
    sources = [f"{name} by {values[name]}" for name in ("scale", "vertical") if values[name]]
    unknown = [name for name in ("scale", "vertical") if not values[name]]
    text = f"{values['datum']}{'; ' if sources else ''}{', '.join(sources)}"
    if not unknown:
        return text
    return (
        f"{text}: without control, {' and '.join(unknown)} are those of the start values, and nothing tells their "
        "error; moma ingest asks for them"
    )
