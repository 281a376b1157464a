"""Diagnosis of synthetic walls whose cause is known: `python -m benchmarks.diagnosis [--draws 100] [--whole 10]`.

The moved stones of a sample are measured again and again: each time with other joints, wear and noise. The runs of each
hypothesis are made once, on the stones of the sample, for a row of amplitudes; motions between two are interpolated.
A few whole diagnoses, each with runs on the stones of its own survey, tell whether that matters.
"""

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.report import Row, columns, guarded, options_of, progress, show
from pipelines.assess.diagnosis.file import DiagnosisFile, read_diagnosis
from pipelines.assess.diagnosis.measurements import Measurements, measure, measurements
from pipelines.assess.diagnosis.ranking import Ranking, verdict
from pipelines.assess.diagnosis.search import Case, Fitted, Place, cases_of, check_case, fit_cases, runs_of
from pipelines.assess.diagnosis.trials import Tried, run_trial
from pipelines.assess.motions import Motions
from pipelines.ingest.ingest import ingest
from pipelines.propose.propose import Recording, propose_core
from pipelines.record.record import record
from survey.quality.facades import facades_of
from survey.quality.precision import appraise
from synthetic.building import SyntheticBuilding
from synthetic.formats import write_moma
from synthetic.samples import recipe_of
from synthetic.true_movement import true_movement
from synthetic.write import write_sample

_SETTLED = "the left corner settled"
_TRUE = {
    "core-sunk": "the core decayed and sank",
    "settled-small": _SETTLED,
    "settled-phases": _SETTLED,
    "shaken": "an earthquake pulse jerked the ground inwards",
}
"""True hypothesis of each sample."""
_SAMPLES: dict[str, dict[str, Any]] = {
    "core-sunk": {"kind": "facings", "moved": "settlement"},
    "settled-small": {"kind": "wall", "moved": "settlement", "small": True},
    "settled-phases": {"kind": "wall", "moved": "settlement", "phases": True},
    "shaken": {"kind": "wall", "moved": "earthquake"},
}
"""What each is written with."""

_GRID = {"core-sunk": 12, "shaken": 12}  # intervals of the range of an unknown, at whose ends runs are made
_FINE = 24  # of other samples
_TABLE = columns(
    "sample sample | runs runs | draws draws :d | first true cause first :d | "
    "explains and explains :d | covered truth within its 95 % :d | truth truth :.3g | "
    "mean mean amount :.4g | scatter its scatter :.2g | half half interval :.3g | unit unit | "
    "none without the true cause: none explains :d | dated dated right :d"
)


@dataclass(frozen=True)
class Laboratory:
    """A sample that can be measured again.

    Attributes
    ----------
    file, cases : its diagnosis
    url : of a database with its stones
    phases : of the stones by code, if it has any
    moved : the true building, measured with a seed
    core : whether a core has to be proposed
    true : name of the true hypothesis
    amount : the truth, in the unit of its unknown
    grid : intervals of the range of an unknown, at whose ends runs are made
    stood : the phases that stood when the ground settled; empty if there are none
    """

    file: DiagnosisFile
    cases: tuple[Case, ...]
    url: str
    phases: dict[str, str]
    moved: Callable[[int], SyntheticBuilding]
    core: bool
    true: str
    amount: float
    grid: int
    stood: tuple[str, ...]

    def survey(self, seed: int) -> Measurements:
        """Measure the building again."""
        stones = [appraise(block) for block in self.moved(seed).blocks()]
        return measure(self.file, stones, facades_of(stones), self.phases)


def laboratory(kind: str, folder: Path) -> Laboratory:
    """Write a sample and take it into a database."""
    recipe = recipe_of(**_SAMPLES[kind])
    write_sample(folder=folder, **_SAMPLES[kind])
    url = f"sqlite:///{folder / 'stones.db'}"
    ingest(list(folder.glob("*.moma")), url)
    if recipe.core:
        propose_core(url, recording=Recording())
    knowledge = folder / "knowledge.toml"
    if knowledge.exists():
        record([knowledge], url)
    file = read_diagnosis(folder / "diagnosis.toml")
    found, cause = measurements(file, url), recipe.cause
    assert cause is not None
    cases = cases_of(file, found.phases)
    possible = tuple(one for one in cases if not check_case(file, one, url, False))
    movement = true_movement(cause)
    return Laboratory(
        file,
        possible,
        url,
        dict(found.phases),
        lambda seed: cause.build(movement, seed).building,
        recipe.core,
        _TRUE[kind],
        cause.amount,
        _GRID.get(kind, _FINE),
        file.phases[:1],
    )


class Interpolated:
    """Motions of the stones of one survey, interpolated between runs at the ends of intervals.

    Parameters
    ----------
    place : the sample
    """

    def __init__(self, place: Laboratory) -> None:
        self._grid = place.grid
        self._run = runs_of(place.file, place.url, lambda trials: [run_trial(one) for one in trials])
        self._known: dict[tuple[str, tuple[str, ...], float], Tried] = {}

    def __call__(self, places: Sequence[Place]) -> list[Tried]:
        """Return the answers to cases of one unknown."""
        return [self._at(case, x) for case, (x,) in places]

    def _at(self, case: Case, x: float) -> Tried:
        (unknown,) = case.hypothesis.unknowns
        step = (unknown.high - unknown.low) / self._grid
        before = min(int((x - unknown.low) / step), self._grid - 1)
        share = (x - unknown.low) / step - before
        ends = [self._end(case, unknown.low + k * step) for k in (before, before + 1)]
        first, second = (one.motions for one in ends)
        if first is None or second is None:
            return ends[0] if first is None else ends[1]
        field = {code: (1.0 - share) * one + share * second.field[code] for code, one in first.field.items()}
        return Tried(Motions(first.middle, field), "", 0.0)

    def _end(self, case: Case, x: float) -> Tried:
        key = (case.hypothesis.name, case.stood, round(x, 12))
        if key not in self._known:
            (self._known[key],) = self._run([(case, (x,))])
            progress(f"{len(self._known)} runs, the last of {case.hypothesis.name}")
        return self._known[key]


def outcome(place: Laboratory, done: Fitted) -> Row:
    """Return what a diagnosis has found, beside the truth."""
    best = done.ranking.hypotheses[0]
    row: Row = {"first": best.name == place.true}
    row["explains"] = row["first"] and best.explains
    true = next(one for one in done.ranking.hypotheses if one.name == place.true and one.stood == place.stood)
    (amount,) = true.estimates
    row["covered"] = amount.low <= place.amount <= amount.high
    row["mean"], row["half"], row["unit"] = amount.value, amount.high - amount.value, amount.unit
    row["truth"] = place.amount
    wrong = tuple(one for one in done.ranking.hypotheses if one.name != place.true)
    row["none"] = verdict(Ranking(wrong, done.ranking.still)).startswith("NONE OF THESE")
    rivals = [one for one in done.ranking.rivals if one.stood != best.stood]
    row["dated"] = best.explains and best.stood == place.stood and not rivals if place.stood else None
    return row


def _summed(kind: str, runs: str, rows: Sequence[Row]) -> Row:
    values = [row["mean"] for row in rows]
    counts = {name: sum(row[name] for row in rows) for name in ("first", "explains", "covered", "none")}
    dated = None if rows[0]["dated"] is None else sum(row["dated"] for row in rows)
    return {
        "sample": kind,
        "runs": runs,
        "draws": len(rows),
        **counts,
        "truth": rows[0]["truth"],
        "unit": rows[0]["unit"],
        "mean": float(np.mean(values)),
        "scatter": float(np.std(values, ddof=1)) if len(values) > 1 else None,
        "half": float(np.mean([row["half"] for row in rows])),
        "dated": dated,
    }


def drawn(place: Laboratory, draws: int) -> list[Row]:
    """Diagnose the sample measured many times, with the runs of one survey."""
    runs = Interpolated(place)
    rows = []
    for seed in range(draws):
        rows.append(outcome(place, fit_cases(place.cases, place.survey(seed).deformation, runs)))
        progress(f"draw {seed + 1} of {draws}")
    return rows


def whole(place: Laboratory, draws: int, folder: Path) -> list[Row]:
    """Diagnose the sample measured a few times, each with runs of its own stones."""
    rows = []
    for seed in range(draws):
        url = f"sqlite:///{folder / f'{seed}.db'}"
        path = folder / f"{seed}.moma"
        write_moma(place.moved(seed).survey, path)
        ingest([path], url)
        if place.core:
            propose_core(url, recording=Recording())
        if place.phases:
            record([folder / "knowledge.toml"], url)
        runs = runs_of(place.file, url, lambda trials: [run_trial(one) for one in trials])
        found = measurements(place.file, url)
        rows.append(outcome(place, fit_cases(place.cases, found.deformation, runs)))
        progress(f"whole diagnosis {seed + 1} of {draws}")
    return rows


def main() -> None:
    """Measure and print."""
    parser = options_of("diagnosis", __doc__)
    parser.add_argument("--draws", type=int, default=100, help="surveys with the runs of one")
    parser.add_argument("--whole", type=int, default=10, help="surveys with runs of their own")
    parser.add_argument("--samples", nargs="+", choices=_TRUE, default=list(_TRUE))
    options = parser.parse_args()
    rows = []
    for kind in options.samples:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name) / kind
            place = laboratory(kind, folder)
            for runs, count, found in (
                ("of one survey", options.draws, partial(drawn, place)),
                ("of each survey", options.whole, partial(whole, place, folder=folder)),
            ):
                if count:
                    rows.append(_summed(kind, runs, found(draws=count)))
    show(rows, _TABLE, as_json=options.json)


if __name__ == "__main__":
    guarded(main)
