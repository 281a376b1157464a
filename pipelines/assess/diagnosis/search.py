"""Search for the amplitudes of all hypotheses at once, so that their runs can be made side by side."""

import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from archmodel.database.session import open_database
from ground.errors import SceneError
from ground.toml.writer import toml_text
from mechanics.arrays import Array
from mechanics.dynamics.progress import Listener, Progress, silent
from mechanics.model.model import build_model
from mechanics.results.forecast.plan import loose_blocks
from pipelines.assess.diagnosis.file import DiagnosisFile, Hypothesis
from pipelines.assess.diagnosis.fit import Ask, Fit, fit
from pipelines.assess.diagnosis.ranking import APART, STILL, Ranked, Ranking, rank, with_others
from pipelines.assess.diagnosis.smoothness import probes, with_unevenness
from pipelines.assess.diagnosis.trials import Runner, Trial, Tried, since_rest
from pipelines.assess.kept import Kept
from pipelines.assess.motions import Motions
from pipelines.run.assemble import assemble
from pipelines.run.soundness import problems_of, refuse_unsound
from pipelines.scene.file import parse_scene
from pipelines.scene.fingerprint import digest
from survey.quality.deformation import Deformation

RECORDS = ("x", "y", "z")
"""Keys of a ground motion that name files."""

_USUAL_TURNS = 3  # of a search
_NOWHERE = Motions({}, {})

_Known = dict[tuple[int, tuple[float, ...]], Tried]


@dataclass(frozen=True)
class Case:
    """A hypothesis at a time.

    Attributes
    ----------
    hypothesis : the movement
    stood : phases that stood then; empty if it is not dated
    later : codes of stones that did not stand yet
    """

    hypothesis: Hypothesis
    stood: tuple[str, ...] = ()
    later: tuple[str, ...] = ()

    def scene(self, file: DiagnosisFile, amplitudes: tuple[float, ...]) -> dict[str, Any]:
        """Return the contents of the scene file with these amplitudes."""
        return _without(self.hypothesis.scene(file.base, amplitudes), self.later)

    def text(self, file: DiagnosisFile, amplitudes: tuple[float, ...]) -> str:
        """Return the scene with these amplitudes as TOML."""
        return toml_text(self.scene(file, amplitudes))

    @property
    def start(self) -> tuple[float, ...]:
        """Amplitudes with which the search begins."""
        return tuple(unknown.start for unknown in self.hypothesis.unknowns)


Place = tuple[Case, tuple[float, ...]]
"""A case with its amplitudes."""

Runs = Callable[[Sequence[Place]], Iterable[Tried]]
"""Function that makes the runs of cases with given amplitudes, and gives the answers as they come."""


@dataclass(frozen=True)
class Fitted:
    """All cases with the amplitudes that explain best.

    Attributes
    ----------
    ranking : the best first
    motions : of the stones at these amplitudes, by name and phases that stood
    runs, cpu : their number, and the time of the processor that they took [s]
    """

    ranking: Ranking
    motions: Mapping[tuple[str, tuple[str, ...]], Motions]
    runs: int
    cpu: float


def cases_of(file: DiagnosisFile, phases: Mapping[str, str]) -> tuple[Case, ...]:
    """Return each hypothesis, at each time if the stones have phases."""
    if not phases:
        return tuple(Case(hypothesis) for hypothesis in file.hypotheses)
    return tuple(
        Case(
            hypothesis,
            file.phases[:count],
            tuple(sorted(code for code, phase in phases.items() if phase in file.phases[count:])),
        )
        for hypothesis in file.hypotheses
        for count in range(len(file.phases), 0, -1)
    )


def check_case(file: DiagnosisFile, case: Case, url: str, accept_unsound: bool) -> str:
    """Refuse a case whose scene cannot be built or is unsound; messages name the hypothesis.

    Returns
    -------
    Reason why it cannot have acted when some phases did not stand yet: its scene lacks stones; empty if it can

    Raises
    ------
    SceneError : at the hypothesis
    UnsoundSceneError : the scene has problems that `check_scene` reports
    """
    name = f"the scene with hypothesis {case.hypothesis.name!r}"
    try:
        # files that the scene names lie beside the scene of the diagnosis
        scene = parse_scene(case.text(file, case.start), file.scene_path)
        with open_database(url, create=False) as database, database.session(read_only=True) as session:
            assembly = assemble(scene, session)
    except SceneError as error:
        if case.later:
            when = f"when phase {' and '.join(case.stood)} alone stood"
            return f"{case.hypothesis.name!r} is not tried {when}: {error.what}"
        file.document.fail(f"{name}: {error.what}", *case.hypothesis.path, remedy=error.remedy)
    if not accept_unsound:
        refuse_unsound(problems_of(scene, assembly, loose_blocks(*build_model(assembly.scene))), name)
    return ""


def runs_of(file: DiagnosisFile, url: str, run: Runner) -> Runs:
    """Return a function that makes the runs of cases by running their scenes.

    If movements count from rest, the scene without any cause is run too, once for each set of stones that stood. A case
    whose formulas have no value at the amplitudes has failed.
    """
    rest: dict[tuple[str, ...], Tried] = {}

    def made(places: Sequence[Place]) -> Iterator[Tried]:
        """Run the trials of places, and yield their results in order."""
        scenes = [_scene_or_fault(file, case, x) for case, x in places]
        trials = [Trial(scene, file.scene_path, url) for scene in scenes if isinstance(scene, str)]
        fresh = [later for later in dict.fromkeys(case.later for case, _ in places) if later not in rest]
        fresh = fresh if file.from_rest else []
        first = [Trial(toml_text(_without(file.base, later)), file.scene_path, url) for later in fresh]
        answers = iter(run([*first, *trials]))
        rest.update({later: next(answers) for later in fresh})
        for (case, _), scene in zip(places, scenes, strict=True):
            tried = next(answers) if isinstance(scene, str) else scene
            yield since_rest(tried, rest[case.later]) if file.from_rest else tried

    return made


def _scene_or_fault(file: DiagnosisFile, case: Case, amplitudes: tuple[float, ...]) -> str | Tried:
    try:
        return case.text(file, amplitudes)
    except SceneError as error:
        return Tried(None, str(error), 0.0)


def kept_runner(file: DiagnosisFile, solids: str, store: Kept, run: Runner) -> Runner:
    """Return a runner that keeps each answer as soon as there is one, and does not run again what is kept.

    Parameters
    ----------
    file : names the scene, beside which the files lie that scenes name
    solids : digest of the stones in the database
    store : the answers
    run : runs the other scenes
    """

    def decides(trial: Trial) -> list[str]:
        """Return everything that decides the result of a trial: stones, scene, and the files it names."""
        scene = tomllib.loads(trial.text)
        return [
            solids,
            trial.text,
            digest([file.read_bytes() for file in named_files(scene, file.scene_path)]),
        ]

    def made(trials: Sequence[Trial]) -> Iterator[Tried]:
        """Run trials that have no stored result; yield all results in order."""
        tried_before = [(trial, keys, store.get(keys)) for trial in trials for keys in [decides(trial)]]
        others = iter(run([trial for trial, _, tried in tried_before if tried is None]))
        for _, keys, tried in tried_before:
            if tried is None:
                tried = next(others)
                store.put(keys, tried)
            yield tried

    return made


def named_files(content: Any, scene: str | Path) -> Iterator[Path]:
    """Yield the files that the contents of a scene file name, which lie beside it."""
    if isinstance(content, list):
        for entry in content:
            yield from named_files(entry, scene)
    elif isinstance(content, Mapping):
        names = RECORDS if content.get("type") == "ground_motion" else ("file",)
        for key, entry in content.items():
            if key in names and isinstance(entry, str):
                yield Path(scene).parent / entry
            else:
                yield from named_files(entry, scene)


def _without(scene: Mapping[str, Any], later: tuple[str, ...]) -> dict[str, Any]:
    """Return the contents of a scene file without stones that did not stand yet."""
    selection = scene.get("select", {})
    return dict(scene) | (
        {"select": {**selection, "exclude": [*selection.get("exclude", []), *later]}} if later else {}
    )


def fit_cases(
    cases: Sequence[Case], deformation: Deformation, runs: Runs, progress: Listener = silent
) -> Fitted:
    """Fit all cases to a deformation and rank them.

    Parameters
    ----------
    cases : hypotheses at their times
    deformation : measured
    runs : makes all runs that are asked for at once
    progress : called after each batch of runs
    """
    searches: dict[int, Ask] = {k: fit(case.hypothesis.unknowns) for k, case in enumerate(cases)}
    asked = {k: next(search) for k, search in searches.items()}
    trials: _Known = {}

    turns: Counter[int] = Counter()

    def make(places: Mapping[int, Sequence[tuple[float, ...]]], text: str = "") -> None:
        """Run all places that have no result yet, and report progress."""
        fresh = [place for k, xs in places.items() for x in xs if (place := (k, x)) not in trials]
        fresh = list(dict.fromkeys(fresh))
        turns.update(list(places))
        total = len(trials) + len(fresh) + (0 if text else _to_come(cases, asked, turns))
        progress(Progress("run", len(trials), total, text or _of_hypotheses(places)))
        for place, tried in zip(fresh, runs([(cases[k], x) for k, x in fresh]), strict=True):
            trials[place] = tried
            progress(Progress("run", len(trials), total, text or _of_hypotheses(places)))

    fits: dict[int, Fit] = {}
    while asked:
        make(asked)
        for k, xs in tuple(asked.items()):
            try:
                asked[k] = searches[k].send([_answer(trials[k, x], deformation) for x in xs])
            except StopIteration as end:
                fits[k] = end.value
                del asked[k]
                headline = _found(cases[k], fits[k], deformation.dof)
                progress(
                    Progress("run", len(trials), len(trials) + _to_come(cases, asked, turns), found=headline)
                )
    ranked, motions = _ranked(cases, fits, trials, deformation)
    # those that may be reported: the best, and what cannot be told apart from it
    least = min(hypothesis.aicc for hypothesis in ranked)
    close = {
        k: [x for probe in probes(case.hypothesis.unknowns, fits[k].amplitudes) for x in probe]
        for k, case in enumerate(cases)
        if ranked[k].aicc < least + APART and len(fits[k].covariance)
    }
    if close:
        make(close, "intervals")
    for k, xs in close.items():
        ranked[k] = _with_probes(ranked[k], cases[k], k, xs, trials, deformation)
    ordered = tuple(sorted(ranked, key=lambda hypothesis: hypothesis.aicc))
    ranking = Ranking(ordered, _rank_of_no_movement(deformation))
    return Fitted(ranking, motions, len(trials), sum(trial.cpu for trial in trials.values()))


def _ranked(
    cases: Sequence[Case], fits: Mapping[int, Fit], trials: _Known, deformation: Deformation
) -> tuple[list[Ranked], dict[tuple[str, tuple[str, ...]], Motions]]:
    """Return the rank of each case, and the motions of its best run, by its name and the phases that stood."""
    ranked, motions = list[Ranked](), dict[tuple[str, tuple[str, ...]], Motions]()
    for k, case in enumerate(cases):
        unknowns = case.hypothesis.unknowns
        fitted = rank(
            case.hypothesis.name, case.stood, unknowns, fits[k], deformation.dof, deformation.freedom
        )
        last = trials[k, fits[k].amplitudes]
        if last.motions is not None and last.fault:
            fitted = replace(fitted, remarks=(*fitted.remarks, last.fault))
        ranked.append(fitted)
        motions[fitted.name, fitted.stood] = last.motions or _NOWHERE
    return ranked, motions


def _rank_of_no_movement(deformation: Deformation) -> Ranked:
    """Return the rank of the hypothesis that no stone has moved."""
    residuals = deformation.residuals(_NOWHERE.displacement)
    unfitted = Fit((), residuals, np.zeros((0, 0)), (), 0)
    return rank(STILL, (), (), unfitted, deformation.dof, deformation.freedom)


def _with_probes(
    ranked: Ranked,
    case: Case,
    k: int,
    places: Sequence[tuple[float, ...]],
    trials: _Known,
    deformation: Deformation,
) -> Ranked:
    """Return the rank of the k-th case with intervals from the runs around its fit, and with its other runs."""
    answers = {x: _answer(trials[k, x], deformation) for x in places}
    uneven = with_unevenness(ranked, case.hypothesis.unknowns, answers)
    everywhere = {
        x: _answer(tried, deformation)
        for (number, x), tried in trials.items()
        if number == k and tried.motions
    }
    misfits = {
        x: float(residuals @ residuals)
        for x, residuals in everywhere.items()
        if not isinstance(residuals, str)
    }
    return with_others(uneven, misfits)


def _to_come(cases: Sequence[Case], asked: Iterable[int], turns: Mapping[int, int]) -> int:
    """Return how many runs are expected after those that have been asked for, as searches usually go."""
    remaining = 0
    for k in asked:
        remaining += max(1, _USUAL_TURNS - turns[k]) * (1 + len(cases[k].hypothesis.unknowns))
    # one or two hypotheses are worth the runs for their intervals
    return remaining + 4 * max((len(case.hypothesis.unknowns) for case in cases), default=0)


def _of_hypotheses(places: Iterable[int]) -> str:
    count = len(list(places))
    return f"{count} {'hypothesis is' if count == 1 else 'hypotheses are'} still being fitted"


def _found(case: Case, done: Fit, dof: int) -> str:
    """Return a hypothesis that has been fitted, in a line."""
    when = f", when phase {' and '.join(case.stood)} stood" if case.stood else ""
    name = f"'{case.hypothesis.name}{when}'"
    if not len(done.residuals):
        return f"{name}: {done.trouble}"
    amounts = ", ".join(
        f"{unknown.name} = {value:.4g} {unknown.unit}"
        for unknown, value in zip(case.hypothesis.unknowns, done.amplitudes, strict=True)
    )
    return f"{name}: χ² {done.chi2:.4g} of {dof - len(done.amplitudes)}, {amounts or 'no unknowns'}"


def _answer(tried: Tried, deformation: Deformation) -> Array | str:
    return tried.fault if tried.motions is None else deformation.residuals(tried.motions.displacement)
