"""report.html: one page that explains a run to whoever was not there; it needs no other file."""

import base64
import io
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from archmodel.records import StoneResult
from mechanics.result import Result
from pipelines.history_plot import history_svg

__all__ = ["write_report"]

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #222; max-width: 60rem; }
body { margin: 2rem auto; padding: 0 1rem; }
h1 { margin-bottom: 0; } h2 { margin-top: 2.2rem; } .lead { font-size: 1.15rem; color: #444; }
figure { margin: 1.5rem 0; } img, svg { max-width: 100%; height: auto; } figcaption { color: #555; }
table { border-collapse: collapse; }
th, td { padding: .3rem .9rem .3rem 0; text-align: left; vertical-align: top; }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
tr + tr { border-top: 1px solid #ddd; } .warning { background: #fff3d6; padding: .6rem 1rem; }
"""

_OUTCOMES = {
    "equilibrium": "It stands: every stone came to rest, in balance.",
    "moving": "It was still moving when the simulated time was over: neither at rest nor collapsed.",
    "collapsed": "It falls: at least one stone moved too far to come back, and was still moving.",
}

_ERRORS = (
    (
        "natural_map",
        "Contact law",
        "How far the contact forces are from satisfying friction and non-penetration: the residual η of the "
        "natural map, without unit. Below the solver's tolerance the step is solved.",
    ),
    ("penetration", "Overlap", "Deepest overlap of two stones, over the size of the smallest one."),
    ("balance", "Balance of each stone", "Force that nothing holds, over the stone's weight; worst stone."),
    ("reaction", "Balance of the whole", "Supports' reaction minus weight, over the weight."),
    ("energy", "Energy", "Energy that no term of the balance explains, over the run's reference energy."),
    ("unconverged_steps", "Unsolved steps", "Steps that the solver left above its tolerance."),
)

_CAPTIONS = {
    "von_mises.png": "Von Mises stress on the stones' surface, in MPa. The scale ends at the stress that 1 % "
    "of the volume exceeds, rounded up. Rigid and fixed stones are grey: no stress was computed in them.",
    "displacement.png": "How far each point has moved since the start; stones are drawn where they are now, "
    "not exaggerated. Fixed stones are grey.",
}


def write_report(
    path: Path,
    result: Result,
    summary: Mapping[str, Any],
    stones: Sequence[StoneResult],
    warnings: Sequence[str],
) -> None:
    """Write the page, with the pictures that lie in its folder inside it.

    Parameters
    ----------
    path : report.html
    summary : as in summary.json
    stones : one per stone
    warnings : what went less well than asked
    """
    pictures = [name for name in _CAPTIONS if (path.parent / name).is_file()]
    body = [
        f"<h1>{escape(result.scene.name)}</h1>",
        f'<p class="lead">{_OUTCOMES[str(result.outcome)]}</p>',
        *(f'<p class="warning">{escape(warning)}</p>' for warning in warnings),
        *(_figure(path.parent / name) for name in pictures),
        "<h2>Summary</h2>",
        _table(_summary_rows(summary)),
        "<h2>How far it can be trusted</h2>",
        _table((name, _scientific(summary["errors"][key]), words) for key, name, words in _ERRORS),
        *_stressed(stones),
        "<h2>History</h2>",
        f"<figure>{history_svg(result.history)}<figcaption>Step by step: speed of the fastest point, "
        "unbalanced force of the worst stone over its weight, and residual of the contact law.</figcaption>"
        "</figure>",
        "<h2>Time spent</h2>",
        _table((stage, f"{seconds:.2f} s") for stage, seconds in summary["time"]["by_stage"].items()),
        f"<p>Made by MOMA {escape(str(summary['version']))}.</p>",
    ]
    page = [
        '<!doctype html><html lang="en"><head><meta charset="utf-8">',
        f"<title>{escape(result.scene.name)}</title><style>{_STYLE}</style></head><body>",
        *body,
        "</body></html>",
    ]
    path.write_text("\n".join(page) + "\n", encoding="utf-8")


def _summary_rows(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    bodies, stress, reaction = summary["bodies"], summary["von_mises"], summary["reaction"]
    rows = [
        ("Stones", ", ".join(f"{count} {name}" for name, count in bodies.items())),
        ("Contact points", str(summary["contacts"])),
        ("Weight carried", f"{reaction['weight'] / 1e3:.2f} kN"),
        ("Reaction of the supports", f"{reaction['total_vertical'] / 1e3:.2f} kN"),
        ("Largest displacement", _millimetres(summary["displacement"]["max"])),
    ]
    if stress is not None:
        rows += [
            ("Von Mises stress, mean", _megapascals(stress["mean"])),
            ("Von Mises stress, exceeded in 1 % of the volume", _megapascals(stress["p99"])),
            ("Von Mises stress, largest", _megapascals(stress["max"])),
        ]
    time = summary["time"]
    rows.append(
        ("Simulated", f"{time['simulated']:.4g} s in {summary['steps']} steps, {time['wall']:.1f} s of work")
    )
    return rows


def _stressed(stones: Sequence[StoneResult]) -> list[str]:
    """The ten stones with the largest stress; nothing where no stone deforms."""
    known = [(stone.von_mises_max, stone) for stone in stones if stone.von_mises_max is not None]
    if not known:
        return []
    known.sort(key=lambda pair: pair[0], reverse=True)
    rows = [
        (
            stone.code,
            _megapascals(largest),
            _megapascals(stone.von_mises_mean),
            _millimetres(stone.displacement_max),
        )
        for largest, stone in known[:10]
    ]
    head = ("Stone", "Von Mises, largest", "Von Mises, mean", "Largest displacement")
    return ["<h2>Most stressed stones</h2>", _table(rows, head)]


def _figure(picture: Path) -> str:
    content = base64.b64encode(picture.read_bytes()).decode("ascii")
    caption = _CAPTIONS[picture.name]
    return (
        f'<figure><img alt="{escape(caption)}" src="data:image/png;base64,{content}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )


def _table(rows: Iterable[Sequence[str]], head: Sequence[str] = ()) -> str:
    out = io.StringIO()
    out.write("<table>")
    if head:
        out.write("<tr>" + "".join(f"<th>{escape(name)}</th>" for name in head) + "</tr>")
    for first, *rest in rows:
        cells = "".join(
            f'<td class="number">{escape(cell)}</td>' if cell[:1].isdigit() else f"<td>{escape(cell)}</td>"
            for cell in rest
        )
        out.write(f"<tr><th>{escape(first)}</th>{cells}</tr>")
    out.write("</table>")
    return out.getvalue()


def _megapascals(pascals: float | None) -> str:
    return "–" if pascals is None else f"{pascals / 1e6:.4f} MPa"


def _millimetres(metres: float) -> str:
    return f"{metres * 1e3:.4g} mm"


def _scientific(value: float | int | None) -> str:
    if value is None or not np.isfinite(value):
        return "not known"
    return str(value) if isinstance(value, int) else f"{value:.1e}"
