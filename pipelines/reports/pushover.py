"""report.html of a loading test: what the stones bear, the curve, how sure it is, and how they moved."""

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from pipelines.reports.html import direction_text, input_rows, kilonewtons, picture, table_of, write_page
from pipelines.results.wall_axes import axes_of

_PICTURES = {
    "curve.png": "Force on the jaws of the rig against the displacement of the push.",
    "peak.png": "The stones at the largest force.",
    "end.png": "The stones at the end of the test.",
}


def write_pushover(path: Path, summary: Mapping[str, Any]) -> None:
    """Write the page and embed the pictures of its folder.

    Parameters
    ----------
    path : report.html
    summary : as in pushover.json
    """
    changes = {} if summary["band"] is None else summary["band"]["by_one_sigma"]
    write_page(
        path,
        "pushover.html",
        name=summary["scene"],
        lead=f"{summary['headline']}. {summary['stones']} stones, weight {1e-3 * summary['weight']:.2f} kN, vertical "
        f"force {1e-3 * summary['load']:.4g} kN, pushed at {summary['height']:g} m.",
        cautions=summary["cautions"],
        inputs=input_rows(summary),
        warnings=(),
        version=summary["versions"]["moma"],
        versions=summary["versions"],
        governs=list(_governs(summary)),
        values=list(_values(summary)),
        band=table_of("band", list(changes.items()), partial(_parameter, summary["band"])),
        level=None if summary["band"] is None else f"{100 * summary['band']['level']:g} %",
        figures=[picture(path.parent / name, words) for name, words in _PICTURES.items()],
    )


def _governs(summary: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield what governs in words: direction, what the stones bear, against what was measured, and how sure it is."""
    axes, direction = axes_of(summary["wall"]), summary["direction"]
    ways = {"forwards": direction, "backwards": [-one for one in direction]}
    for way, force in summary["strength"].items():
        if force:
            yield (
                f"Bears {way}",
                f"{kilonewtons(abs(force))} {direction_text(axes, ways[way])}, {summary['height']:g} m above the "
                f"foot, under {kilonewtons(summary['load'])} from above",
            )
    for name, ratio in ((summary["measured"] or {}).get("ratio") or {}).items():
        if ratio is not None:
            measured = summary["measured"]["strength"][name]
            yield f"Measured {name}", f"{kilonewtons(abs(measured))}; predicted over measured {ratio:.3f}"
    if (band := summary["band"]) is None:
        yield (
            "How sure it is",
            "strengths, stiffness, loads and depths are taken as certain: no scatter was stated",
        )
    else:
        known = ", ".join(band["scatter"])
        yield (
            "How sure it is",
            f"± {kilonewtons(band['strength'])} holds {100 * band['level']:g} % of the outcomes, from the scatter of "
            f"{known}; all else, as the depths, is taken as certain",
        )


def _values(summary: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    for name, value in summary["strength"].items():
        if value:
            yield f"Largest force {name}", f"{1e-3 * value:.4g} kN"
    secants = f"{1e-6 * summary['early_stiffness']:.3g} and {1e-6 * summary['stiffness']:.3g} kN/mm"
    yield "Initial stiffness, secants at 15 and 30 % of it", secants
    yield "Share of the displacement by stones that turn", f"{summary['turning']:.2f}"
    yield "Settling under the vertical force", f"{1e3 * summary['settling']:.3g} mm"
    errors = summary["errors"]
    yield "Error of the rate, largest of calm steps", f"{1e-3 * errors['rate']:.2g} kN"
    yield (
        "Steps, not solved, disturbed by inertia",
        (f"{summary['steps']}, {errors['unsolved']}, {errors['disturbed']}"),
    )
    yield "Energy that no term explains", f"{errors['energy']:.1e}"


def _parameter(band: Mapping[str, Any], change: tuple[str, float]) -> dict[str, str]:
    """Return what one standard deviation of a parameter changes."""
    name, force = change
    return {
        "parameter": name,
        "scatter": f"{100 * band['scatter'][name]:.3g} %",
        "change": f"{1e-3 * force:+.3g} kN",
    }
