"""Date of a movement against building phases: the phases that stood when it acted, with the evidence stone by stone.

A hypothesis is fitted once for each time at which it may have acted; the phases that did not stand yet take no part in
its runs, and their courses are to be level. The bed of a later stone on an earlier one may follow what had moved
already, and is left out. Of the whole movement, as it would be if all phases had stood, each phase shows a share
s = Σ r_w r_z / Σ r_w², with the standardised departures r_z of its courses and r_w of the movement; σ = 1 / √Σ r_w².
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from pipelines.assess.diagnosis.file import DiagnosisFile
from pipelines.assess.diagnosis.measurements import Measurements
from pipelines.assess.diagnosis.ranking import Ranked, Ranking
from pipelines.assess.motions import Motions
from survey.conventions import LISTED, NOTICEABLE
from survey.quality.departures.beds import measure_beds
from survey.quality.movement import CourseMovement, compare_courses

_FELT = NOTICEABLE  # standard deviations of a movement below which a phase says nothing


@dataclass(frozen=True)
class Share:
    """Part of the movement that the courses of a phase show.

    Attributes
    ----------
    phase : its name
    value, sigma : [-]; None if the movement would hardly have touched it
    """

    phase: str
    value: float | None
    sigma: float | None


@dataclass(frozen=True)
class Dating:
    """Date of the best hypothesis.

    Attributes
    ----------
    verdict : in one line
    shares : of the phases, the oldest first
    evidence : lines that lead to the verdict
    """

    verdict: str
    shares: tuple[Share, ...]
    evidence: tuple[str, ...]


def date_movement(
    file: DiagnosisFile, ranking: Ranking, measurements: Measurements, whole: Motions
) -> Dating:
    """Date the best hypothesis.

    Parameters
    ----------
    file : with the phases, the oldest first
    ranking : of all hypotheses at all times
    measurements : the survey
    whole : motions by the best, of as much as it is estimated, if all phases had stood
    """
    best = ranking.hypotheses[0]
    shares = tuple(_share(measurements, phase, whole) for phase in file.phases)
    evidence = tuple(_evidence(measurements, whole, shares))
    return Dating(_verdict(file, ranking, best), shares, evidence)


def _verdict(file: DiagnosisFile, ranking: Ranking, best: Ranked) -> str:
    if not best.explains:
        return "not dated, as no hypothesis explains the movement; the shares below tell of courses alone"
    rivals = [rival for rival in ranking.rivals if rival.stood != best.stood]
    if rivals:
        return f"not dated: {best.title!r} and {rivals[0].title!r} explain what was measured about as well"
    others = [
        hypothesis
        for hypothesis in ranking.hypotheses
        if hypothesis.name == best.name and hypothesis.stood != best.stood
    ]
    if not others:
        return f"not dated: {best.name!r} could be tried at one time only"
    margin = min(hypothesis.aicc for hypothesis in others) - best.aicc
    last, later = best.stood[-1], file.phases[len(best.stood) :]
    when = f"younger than phase {last}" + (f" and older than phase {later[0]}" if later else "")
    return f"the movement is {when} (AICc of other dates larger by {margin:.3g} or more)"


def _share(measurements: Measurements, phase: str, whole: Motions) -> Share:
    product = square = 0.0
    for group in measurements.deformation.groups:
        if measurements.phases[group.codes[0]] == phase:
            moved = group.whitening @ group.simulated(whole.displacement)
            product += float(moved @ (group.whitening @ group.values))
            square += float(moved @ moved)
    if square < _FELT**2:
        return Share(phase, None, None)
    return Share(phase, product / square, 1.0 / math.sqrt(square))


def _evidence(measurements: Measurements, whole: Motions, shares: tuple[Share, ...]) -> Iterator[str]:
    lines = compare_courses(measure_beds(measurements.stones, measurements.facades)[0], whole.displacement)
    for index, share in enumerate(shares):
        dated = [line for line in lines if measurements.phases[line.line.codes[0]] == share.phase]
        if share.value is None:
            yield f"phase {share.phase}: the movement would hardly have touched its courses"
        else:
            yield f"phase {share.phase} shows {share.value:.2f} ± {share.sigma:.2f} of the movement (one σ)"
        resting = sorted({code for line in dated for code in line.stones if code in measurements.resting})
        if resting:
            yield (
                f"  {', '.join(resting)} of phase {share.phase} rest on stones of an earlier phase: "
                "their beds may follow what had moved already and are left out"
            )
        # the last courses of a phase before the break, the first of the later one
        nearest = sorted(dated, key=lambda line: line.line.course, reverse=index == 0)
        texts = [text for line in nearest if (text := _course(line, measurements.resting)) is not None]
        yield from texts[:LISTED]


def _course(line: CourseMovement, resting: frozenset[str]) -> str | None:
    """Return the two stones of a course between which the movement is largest, measured and simulated."""
    stones = {code: stone for code, stone in line.stones.items() if code not in resting}
    if len(stones) < 2:
        return None
    low, high = (pick(stones, key=lambda code: stones[code].simulated) for pick in (min, max))
    fell, stood = stones[low], stones[high]
    sigma = math.hypot(fell.sigma, stood.sigma)
    measured, simulated = stood.measured - fell.measured, stood.simulated - fell.simulated
    return (
        f"  course {line.line.course}: {low} lies {1e3 * measured:.1f} ± {1e3 * sigma:.1f} mm below {high}; "
        f"the movement makes it {1e3 * simulated:.1f} mm"
    )
