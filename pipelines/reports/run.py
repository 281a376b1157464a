"""report.html: one page that explains a run to whoever was not there; it needs no other file."""

from collections.abc import Callable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from archmodel.store.run_record import StoneResult
from mechanics.results.result import Result
from pipelines.draw.history_plot import history_svg
from pipelines.reports.html import figure, megapascals, millimetres, page, percent, ratio, scientific, table
from pipelines.reports.joints import joint_sections

__all__ = ["write_report"]

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
    (
        "stress",
        "Stress",
        "Relative error of the stress of all stones that deform, estimated from its jumps between finite elements.",
    ),
)

_GREY = "Grey stones are fixed or rigid, or their stress was not asked for."
_CAPTIONS = {
    "von_mises.png": "Von Mises stress on the stones' surface, in MPa. The scale ends at the stress that 1 % "
    f"of the volume exceeds, rounded up. {_GREY}",
    "displacement.png": "How far each point has moved since the start; stones are drawn where they are now, "
    "not exaggerated. Fixed stones are grey.",
    "principal_tension.png": f"Largest principal stress, where it is tension. {_GREY}",
    "principal_compression.png": f"Smallest principal stress, where it is compression. {_GREY}",
    "utilisation.png": f"Stress over strength, the larger of tension and compression: at 1 a stone fails. {_GREY}",
    "error.png": "Estimated error of the stress of each stone (Zienkiewicz and Zhu): where it is large, the mesh is "
    f"too coarse for its stress. {_GREY}",
    "pressure.png": "Mean pressure of each joint that is pressed; the stones are drawn as glass.",
    "resultants.png": "The resultant of each joint, drawn through the point where it meets the joint, as long as it is "
    "large. Blue: within the kern, so that a linear pressure presses everywhere. Red: outside, so that part of the "
    "joint bears nothing.",
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
        *(figure(path.parent / name, _CAPTIONS[name]) for name in pictures),
        "<h2>Summary</h2>",
        table(_summary_rows(summary)),
        "<h2>How far it can be trusted</h2>",
        table((name, scientific(summary["errors"][key]), words) for key, name, words in _ERRORS),
        *_profile(summary["profile"]),
        *_stressed(stones),
        *_pulled(stones),
        *_uncertain(stones),
        *joint_sections(result),
        "<h2>History</h2>",
        f"<figure>{history_svg(result.history)}<figcaption>Step by step: speed of the fastest point, "
        "unbalanced force of the worst stone over its weight, and residual of the contact law.</figcaption>"
        "</figure>",
        "<h2>Time spent</h2>",
        table((stage, f"{seconds:.2f} s") for stage, seconds in summary["time"]["by_stage"].items()),
        f"<p>Made by MOMA {escape(str(summary['version']))}.</p>",
    ]
    path.write_text(page(result.scene.name, body), encoding="utf-8")


def _summary_rows(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    bodies, stress, reaction = summary["bodies"], summary["von_mises"], summary["reaction"]
    rows = [
        ("Stones", ", ".join(f"{count} {name}" for name, count in bodies.items())),
        ("Contact points", str(summary["contacts"])),
        ("Weight carried", f"{reaction['weight'] / 1e3:.2f} kN"),
        ("Reaction of the supports", f"{reaction['total_vertical'] / 1e3:.2f} kN"),
        ("Largest displacement", millimetres(summary["displacement"]["max"])),
    ]
    if stress is not None:
        rows += [
            ("Von Mises stress, mean", megapascals(stress["mean"])),
            ("Von Mises stress, exceeded in 1 % of the volume", megapascals(stress["p99"])),
            ("Von Mises stress, largest", megapascals(stress["max"])),
        ]
    if (static := summary["static"]) is not None and static["found"]:
        rows.append(
            (
                "Began in static equilibrium",
                f"found in {static['steps']} steps, balance {static['balance']:.1e}",
            )
        )
    time = summary["time"]
    rows.append(
        ("Simulated", f"{time['simulated']:.4g} s in {summary['steps']} steps, {time['wall']:.1f} s of work")
    )
    return rows


def _profile(profile: Mapping[str, Any] | None) -> list[str]:
    """The settings that a profile gave the run, and the errors to expect of it; nothing without one."""
    if profile is None:
        return []
    settings = ", ".join(f"{name} {value}" for name, value in profile["settings"].items())
    words = (
        f"<h2>Profile: {escape(profile['name'])}</h2>"
        f"<p>{escape(profile['about'].capitalize())}. Its settings went before those of the scene: "
        f"{escape(settings)}.</p>"
    )
    if not profile["expected"]:
        return [words, "<p>What error to expect was measured on scenes at rest only.</p>"]
    rows = [
        (one["of"].capitalize(), f"{'up to ' if one['bound'] else ''}{percent(one['value'])}")
        for one in profile["expected"].values()
    ]
    note = (
        "<p>Errors to expect against a much finer model, from what was measured on other scenes and this run's own "
        "estimates. The largest Von Mises stress has none: at the edges of joints it grows with every finer mesh.</p>"
    )
    return [words, note, table(rows, ("Quantity", "Error to expect"))]


def _stressed(stones: Sequence[StoneResult]) -> list[str]:
    """The ten stones with the largest stress; nothing where no stone deforms."""
    rows = [
        (
            stone.code,
            megapascals(stone.von_mises_max),
            megapascals(stone.von_mises_mean),
            millimetres(stone.displacement_max),
        )
        for stone in _worst(stones, lambda stone: stone.von_mises_max)
    ]
    head = ("Stone", "Von Mises, largest", "Von Mises, mean", "Largest displacement")
    return ["<h2>Most stressed stones</h2>", table(rows, head)] if rows else []


def _pulled(stones: Sequence[StoneResult]) -> list[str]:
    """The ten stones that are nearest to their strength, or, where no strength is known, with the largest tension."""
    used = _worst(stones, lambda stone: stone.values.get("utilisation"))
    rows = [
        (
            stone.code,
            ratio(stone.values.get("utilisation")),
            megapascals(stone.values["principal_tension"]),
            percent(stone.values["tension_zone"]),
            megapascals(stone.values["principal_compression"]),
            megapascals(stone.values["mean_pressure"]),
        )
        for stone in used or _worst(stones, lambda stone: stone.values.get("principal_tension"))
    ]
    head = (
        "Stone", "Stress over strength", "Tension, largest", "Volume in tension", "Compression, largest",
        "Pressure, mean",
    )  # fmt: skip
    title = "Stones nearest to their strength" if used else "Stones with the largest tension"
    return [f"<h2>{title}</h2>", table(rows, head)] if rows else []


def _uncertain(stones: Sequence[StoneResult]) -> list[str]:
    """The ten stones whose stress is least certain."""
    rows = [
        (stone.code, percent(stone.values["stress_error"]), megapascals(stone.von_mises_max))
        for stone in _worst(stones, lambda stone: stone.values.get("stress_error"))
    ]
    words = "<p>Estimated from the jumps of the stress between finite elements; a finer mesh makes it smaller.</p>"
    head = ("Stone", "Error of the stress", "Von Mises, largest")
    return ["<h2>Stones with the least certain stress</h2>", words, table(rows, head)] if rows else []


def _worst(stones: Sequence[StoneResult], value: Callable[[StoneResult], float | None]) -> list[StoneResult]:
    """The ten stones with the largest values, of those that have one."""
    known = [(found, stone) for stone in stones if (found := value(stone)) is not None]
    known.sort(key=lambda pair: pair[0], reverse=True)
    return [stone for _, stone in known[:10]]
