"""Walls that laboratories broke beside what MOMA predicts: `python -m benchmarks.experiments [--data DIR] [--only …]`.

Nothing is fitted to a curve: inputs are measured, of a model of others, or assumed (`benchmarks.broken_walls`). Masks
and outlines of rubble walls belong to others, and are read from `--data`; without them these walls are left out.
`--figures DIR` draws each curve, the measured one beside it where its file is in `curves`. `--write` puts the tables
into docs/accuracy.md.
"""

import json
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.broken_walls import EXPERIMENTS, Experiment, Inputs, Rubble, granite, granite_inputs
from benchmarks.report import (
    ROOT,
    Row,
    columns,
    commit,
    guarded,
    machine,
    options_of,
    print_table,
    progress,
    show,
    table_lines,
    write_between,
)
from pipelines.assess.pushover.findings import mechanism_of
from pipelines.assess.pushover.push import read_curve
from pipelines.draw.loading import draw_curve, draw_pushed

_DATA = ROOT.parent / "shared" / "data" / "experiments"
_PLACES = (0.002, 0.005, 0.01, 0.02, 0.03)  # displacements at which forces are compared [m]

_TABLE = columns(
    "test wall | measured_text measured, kN | predicted_text predicted, kN | ratio_text predicted over mean measured | "
    "early_text secants at 15 %: measured; predicted, kN/mm | stiffness_text at 30 % | forces over measured at "
    "2, 5, 10, 20, 30 mm | observed observed | mechanism predicted | unsolved steps not solved | seconds time, s :.0f"
)


def _row(name: str, one: Experiment, data: Path, figures: Path | None) -> Row:
    began = time.process_time()
    with TemporaryDirectory() as folder:
        tests = one.predict(data, Path(folder))
    seconds, test = time.process_time() - began, tests[0]
    predicted = [1e-3 * max(other.strength, key=abs) for other in tests]
    measured = [
        float(np.mean([force for force in one.measured if force * sign > 0])) for sign in _signs(predicted)
    ]
    ratios = [one / two for one, two in zip(predicted, measured, strict=True)]
    found = 1e-3 * test.at(np.array(_PLACES))
    row = {
        "test": one.test,
        "source": one.source,
        "measured": list(one.measured),
        "predicted": predicted,
        "ratio": ratios,
        "early_measured": list(one.early),
        "early": 1e-6 * test.early_stiffness,
        "stiffness_measured": list(one.stiffness),
        "stiffness": 1e-6 * test.stiffness,
        "forces": " ".join(f"{a / b:.2f}" for a, b in zip(found, one.forces, strict=True))
        if one.forces
        else None,
        "displacements": [1e3 * place for place in _PLACES],
        "forces_predicted": [None if np.isnan(force) else float(force) for force in found],
        "forces_measured": list(one.forces),
        "observed": one.mechanism,
        "mechanism": mechanism_of(test.turning),
        "turning": test.turning,
        "assumed": one.assumed,
        "inputs": {name: asdict(value) for name, value in one.inputs.items()},
        "unsolved": f"{sum(other.unsolved for other in tests)} of {sum(len(other.force) for other in tests)}",
        "energy_error": test.energy_error,
        "seconds": seconds,
        "measured_text": ", ".join(f"{force:.4g}" for force in one.measured),
        "predicted_text": ", ".join(f"{force:.4g}" for force in predicted),
        "early_text": _beside(one.early, 1e-6 * test.early_stiffness),
        "stiffness_text": _beside(one.stiffness, 1e-6 * test.stiffness),
        "ratio_text": ", ".join(f"{ratio:.3f}" for ratio in ratios),
    }
    if figures is not None:
        file = data / "curves" / one.curve
        curve = read_curve(file) if one.curve and file.exists() else None
        draw_curve(figures / f"{name}.png", one.test, test, None, curve)
        draw_pushed(figures / f"{name}-end.png", one.test, test, test.end)
    return row


def _beside(measured: Iterable[float], predicted: float) -> str:
    """Return stiffnesses that were measured, and the predicted one, as text [kN/mm]."""
    return f"{', '.join(f'{one:g}' for one in measured) or '–'}; {predicted:.1f}"


def _input_rows(names: Mapping[str, Experiment]) -> list[Row]:
    """Return a row for each input of the walls, those that share it together."""
    shared: dict[tuple[str, float, str, str], list[str]] = {}
    for one in names.values():
        for name, value in one.inputs.items():
            shared.setdefault((name, value.value, value.unit, value.origin), []).append(one.test)
    return [
        {
            "walls": ", ".join(dict.fromkeys(walls)),
            "input": name,
            "value": _quantity(value, unit),
            "origin": origin,
        }
        for (name, value, unit, origin), walls in shared.items()
    ]


def _quantity(value: float, unit: str) -> str:
    """Return a value with its unit, of pressures and stiffnesses with a prefix."""
    for factor, prefix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if unit.startswith("Pa") and value >= factor:
            return f"{value / factor:.3g} {prefix}{unit}"
    return f"{value:.4g} {unit}" if unit != "-" else f"{value:.3g}"


_INPUTS = columns("input input | value value | origin origin | walls of")

METHOD: Mapping[str, Mapping[str, float]] = {
    "as predicted": {},
    "half the step": {"step": 0.075e-3},
    "twice the step": {"step": 0.3e-3},
    "half the distance of points": {"distance of contact points": 0.025},
    "twice the distance of points": {"distance of contact points": 0.1},
    "friction 0.55": {"friction": 0.55},
    "friction 0.70": {"friction": 0.70},
}
"""What is changed in WS.100 by --method."""

_EFFECTS = columns("changed changed | strength strength, kN :.2f | effect change, % :+.2f")


def _effects() -> Iterator[Row]:
    first: float | None = None
    for name, changes in METHOD.items():
        progress(name)
        strength = 1e-3 * granite(100e3, _changed(changes), changes.get("step")).strength[0]
        first = first or strength
        yield {"changed": name, "strength": strength, "effect": 100.0 * (strength / first - 1.0)}


def _changed(changes: Mapping[str, float]) -> Inputs:
    """Return the inputs of WS.100 with some of another value."""
    return {
        name: replace(one, value=changes.get(name, one.value)) for name, one in granite_inputs(100e3).items()
    }


def _signs(forces: Iterable[float]) -> list[float]:
    return [float(np.sign(force)) for force in forces]


def _rows(names: Mapping[str, Experiment], data: Path, figures: Path | None) -> Iterator[Row]:
    for name, one in names.items():
        if isinstance(one.predict, Rubble) and not (data / one.predict.file).exists():
            continue
        progress(name)
        yield _row(name, one, data, figures)


def main() -> None:
    """Predict the walls, and print them beside what was measured."""
    options = options_of("experiments", __doc__)
    options.add_argument("--data", type=Path, default=_DATA, help="folder of masks, outlines and curves")
    options.add_argument("--only", nargs="+", choices=sorted(EXPERIMENTS), help="these walls")
    options.add_argument("--figures", type=Path, help="folder for a figure of each wall")
    options.add_argument(
        "--method", action="store_true", help="effects of step, points and friction on WS.100 alone"
    )
    options.add_argument("--write", action="store_true", help="put the table into docs/accuracy.md")
    given = options.parse_args()
    if given.method:
        show(list(_effects()), _EFFECTS, as_json=given.json)
        return
    chosen = {name: one for name, one in EXPERIMENTS.items() if not given.only or name in given.only}
    if given.figures is not None:
        given.figures.mkdir(parents=True, exist_ok=True)
    rows = list(_rows(chosen, given.data, given.figures))
    if given.json:
        print(json.dumps({"walls": rows, "machine": machine(), "commit": commit()}, indent=1))
        return
    print(f"{commit()}; {machine()}")
    print_table(rows, _TABLE)
    print_table(_input_rows(chosen), _INPUTS)
    if given.write:
        write_between(
            "experiments",
            [
                f"{commit()}; {machine()}.",
                "",
                *table_lines(rows, _TABLE),
                "",
                *table_lines(_input_rows(chosen), _INPUTS),
            ],
            ROOT / "docs" / "accuracy.md",
        )


if __name__ == "__main__":
    guarded(main)
