"""Search for the amplitudes of all hypotheses at once, so that their runs can be made side by side."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from archmodel.database.session import open_database
from mechanics.arrays import Array
from mechanics.dynamics.progress import Listener, Progress, silent
from mechanics.model.model import build_model
from mechanics.results.forecast.plan import loose_blocks
from moma.errors import SceneError
from pipelines.assess.diagnosis.file import DiagnosisFile, Hypothesis
from pipelines.assess.diagnosis.fit import Ask, Fit, fit
from pipelines.assess.diagnosis.ranking import APART, STILL, Ranked, Ranking, rank, with_others
from pipelines.assess.diagnosis.smoothness import probes, with_unevenness
from pipelines.assess.diagnosis.trials import Runner, Trial, Tried, since_rest
from pipelines.assess.motions import Motions
from pipelines.run.assemble import assemble
from pipelines.run.soundness import problems_of, refuse_unsound
from pipelines.scene.file import parse_scene
from pipelines.toml.writer import toml_text
from survey.quality.deformation import Deformation

__all__ = ["Case", "Fitted", "Place", "Runs", "cases_of", "check_case", "fit_cases", "runs_of"]

_NOWHERE = Motions({}, {})


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
        return tuple(one.start for one in self.hypothesis.unknowns)


Place = tuple[Case, tuple[float, ...]]
"""A case with its amplitudes."""

Runs = Callable[[Sequence[Place]], Sequence[Tried]]
"""Function that makes the runs of cases with given amplitudes."""


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
        return tuple(Case(one) for one in file.hypotheses)
    return tuple(
        Case(
            one,
            file.phases[:count],
            tuple(sorted(code for code, phase in phases.items() if phase in file.phases[count:])),
        )
        for one in file.hypotheses
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

    If movements count from rest, the scene without any cause is run too, once for each set of stones that stood.
    """
    rest: dict[tuple[str, ...], Tried] = {}

    def made(places: Sequence[Place]) -> list[Tried]:
        trials = [Trial(case.text(file, x), file.scene_path, url) for case, x in places]
        if not file.from_rest:
            return list(run(trials))
        fresh = [later for later in dict.fromkeys(case.later for case, _ in places) if later not in rest]
        first = [Trial(toml_text(_without(file.base, later)), file.scene_path, url) for later in fresh]
        answers = run([*first, *trials])
        rest.update(zip(fresh, answers, strict=False))
        return [
            since_rest(one, rest[case.later])
            for (case, _), one in zip(places, answers[len(fresh) :], strict=True)
        ]

    return made


def _without(scene: Mapping[str, Any], later: tuple[str, ...]) -> dict[str, Any]:
    """Return the contents of a scene file without stones that did not stand yet."""
    own = scene.get("select", {})
    return dict(scene) | ({"select": {**own, "exclude": [*own.get("exclude", []), *later]}} if later else {})


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
    known: dict[tuple[int, tuple[float, ...]], Tried] = {}

    def make(places: Mapping[int, Sequence[tuple[float, ...]]]) -> None:
        fresh = [place for k, xs in places.items() for x in xs if (place := (k, x)) not in known]
        fresh = list(dict.fromkeys(fresh))
        progress(Progress("run", len(known), None, f"{len(fresh)} runs for {len(places)} hypotheses"))
        answers = runs([(cases[k], x) for k, x in fresh])
        known.update(zip(fresh, answers, strict=True))

    fits: dict[int, Fit] = {}
    while asked:
        make(asked)
        for k, xs in tuple(asked.items()):
            try:
                asked[k] = searches[k].send([_answer(known[k, x], deformation) for x in xs])
            except StopIteration as end:
                fits[k] = end.value
                del asked[k]
    ranked, motions = list[Ranked](), {}
    for k, case in enumerate(cases):
        unknowns = case.hypothesis.unknowns
        one = rank(case.hypothesis.name, case.stood, unknowns, fits[k], deformation.dof, deformation.steps)
        last = known[k, fits[k].amplitudes]
        if last.motions is not None and last.fault:
            one = replace(one, remarks=(*one.remarks, last.fault))
        ranked.append(one)
        motions[one.name, one.stood] = last.motions or _NOWHERE
    # those that may be reported: the best, and what cannot be told apart from it
    least = min(one.aicc for one in ranked)
    near = {
        k: [x for own in probes(case.hypothesis.unknowns, fits[k].amplitudes) for x in own]
        for k, case in enumerate(cases)
        if ranked[k].aicc < least + APART and len(fits[k].covariance)
    }
    if near:
        make(near)
    for k, xs in near.items():
        answers = {x: _answer(known[k, x], deformation) for x in xs}
        uneven = with_unevenness(ranked[k], cases[k].hypothesis.unknowns, answers)
        everywhere = {
            x: _answer(tried, deformation) for (own, x), tried in known.items() if own == k and tried.motions
        }
        ranked[k] = with_others(
            uneven, {x: float(one @ one) for x, one in everywhere.items() if not isinstance(one, str)}
        )
    residuals = deformation.residuals(_NOWHERE.displacement)
    still = Fit((), residuals, np.zeros((0, 0)), (), 0)
    ranking = Ranking(
        tuple(sorted(ranked, key=lambda one: one.aicc)),
        rank(STILL, (), (), still, deformation.dof, deformation.steps),
    )
    return Fitted(ranking, motions, len(known), sum(one.cpu for one in known.values()))


def _answer(tried: Tried, deformation: Deformation) -> Array | str:
    return tried.fault if tried.motions is None else deformation.residuals(tried.motions.displacement)
