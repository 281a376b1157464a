"""Answers of an assessment: the numbers of a question, what they are called, and the mechanism that goes with them."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from ground.errors import SolverError
from mechanics.arrays import Array
from mechanics.dynamics.outcome import Outcome
from mechanics.limit.assembly import RigidAssembly
from mechanics.limit.confirm import Confirmation, confirm, likeness
from mechanics.limit.dead_load import Standing
from mechanics.limit.held import WIDTH, held_limit
from mechanics.limit.kinematic import Kinematics, kinematics
from mechanics.limit.limit_load import (
    Flow,
    LimitLoad,
    Mechanism,
    limit_load,
    mechanism,
    slides_along_one_line,
    without_friction_across,
)
from mechanics.limit.live_loads import Acceleration, LiveLoad
from mechanics.limit.pushover import Pushover, pushover
from mechanics.limit.thickness import geometric_safety
from mechanics.limit.thrust import thrust
from pipelines.assess.codes.check import check_code
from pipelines.assess.questions import LoadQuestion, Question, Thickness, ThrustQuestion
from pipelines.assess.sensitivity import sensitivity
from pipelines.scene.site import Site
from survey.conventions import NEGLIGIBLE, PER_CENT, TENTH

FALLS = "falls under its own weight"
"""Outcome of what does not stand at all."""

NOT_DECIDED = "not decided"
"""Outcome of what neither rests nor has fallen when its time is over."""

_DROP = 0.8  # share of the peak of a capacity curve at which the way counts as ultimate [-]
_ONE = 1.0 + NEGLIGIBLE  # limit over lowest candidate up to which they are one [-]
_SOUGHT = (
    500  # stones up to which candidates are sought: their iteration takes ten times as long as the limit [-]
)
_BY_RUNS = "Coulomb's friction without dilatancy, by the rule of runs: the largest load that one step from rest holds"
_CRUSHED = "Coulomb's friction without dilatancy, candidate: stones crush, which rigid ones in runs do not"
_UNSURE = "candidate or bound: the stones rest, but one step from rest moves them under the dead load alone"
_ALIKE = 1.0 - TENTH  # cosine between mechanism and collapse from which they are one [-]
_SAME = PER_CENT  # by which λ without friction across the line of sliding is lower, from which it is told [-]
_MOVES = PER_CENT  # speed over that of the fastest stone from which a stone belongs to a mechanism [-]

_FIRST = 1.0  # λ from which runs seek the limit of a load that the bound does not limit [-]

Confirm = Callable[[LiveLoad, float, float], Confirmation]
"""Confirmation of a candidate by runs, below a bound."""

Lead = Callable[[LiveLoad, LimitLoad, float | None], Pushover]
"""Pushover from a limit load, to a way [m] if one is known."""


@dataclass(frozen=True)
class Answer:
    """Answer to a question.

    Attributes
    ----------
    told : what assessment.json says of it
    mechanism : how the stones begin to fall, or follow a support that yields
    force : (nc, 3) on the candidate of each contact at the limit, local frame; zero where nothing balances [N]
    curve : capacity curve; None: there is none
    """

    told: dict[str, Any]
    mechanism: Mechanism
    force: Array
    curve: Pushover | None = None


def answer(
    on: RigidAssembly,
    question: Question,
    confirming: Confirm,
    leading: Lead,
    site: Site | None,
    outwards: Array | None = None,
) -> Answer:
    """Answer a question about an assembly.

    Parameters
    ----------
    confirming : runs that confirm the candidate of a load, if the question asks for them
    leading : runs that lead the stones of its mechanism to collapse, if the question asks for them
    site : of the check by a code; None: no question asks for one
    outwards : (3,) along which the stones are deep; None: not known

    Raises
    ------
    SceneError, SolverError : see `mechanics.limit`
    """
    match question:
        case LoadQuestion():
            return _load(on, question, confirming, leading, site, outwards)
        case ThrustQuestion():
            return _thrust(on, question)
        case Thickness():
            return _thickness(on, question)


def refuse_unanswerable(on: RigidAssembly, question: Question) -> None:
    """Refuse a question about stones that the scene does not have, or that it may not load.

    Raises
    ------
    SceneError : the stone is unknown, or fixed where it must be free
    """
    match question:
        case LoadQuestion():
            question.live(on)
        case ThrustQuestion():
            on.rows(question.supports, question.name)
        case Thickness():
            pass


def confirmer(on: RigidAssembly, runs: int, **listeners: Any) -> Confirm:
    """Return what confirms a candidate by runs of the stones, all rigid."""
    return lambda live, candidate, bound: confirm(on, live, candidate, bound, runs, **listeners)


def leader(on: RigidAssembly, **listeners: Any) -> Lead:
    """Return what leads a mechanism to collapse by runs of the stones, all rigid."""
    return lambda live, limit, reach: pushover(on, live, limit, reach, **listeners)


def fallen(on: RigidAssembly, question: Question, standing: Standing) -> Answer:
    """Return the answer to any question about stones that do not rest under their dead load."""
    velocity = np.zeros((len(on.model.mass), 6))
    velocity[:, :3] = standing.displacement
    falls = mechanism(on, velocity[on.free])
    kind = "load"
    state = FALLS if standing.outcome is Outcome.COLLAPSED else NOT_DECIDED
    facts: dict[str, Any] = {"name": question.name, "outcome": state, "headline": f"{question.name}: {state}"}
    match question:
        case LoadQuestion():
            facts |= {"meaning": str(question.live), "candidate": None, "candidate_lowest": None}
            facts |= {"bound": None, "candidate_converged": None}
            facts |= dict.fromkeys(("limit", "limit_lost", "limit_sure"), 0.0)
        case ThrustQuestion():
            kind = "settlement" if question.settles else "thrust"
            facts |= {
                "meaning": f"push on {', '.join(question.supports)} [N]",
                "least": None,
                "greatest": None,
            }
        case Thickness():
            kind = "thickness"
            facts |= {"meaning": "share to which all joints may shrink", "factor": None, "share": None}
    facts |= {"kind": kind, "mechanism": _moving(on, falls)}
    return Answer(facts, falls, np.zeros((len(on.contacts), 3)))


def _load(
    on: RigidAssembly,
    question: LoadQuestion,
    confirming: Confirm,
    leading: Lead,
    site: Site | None,
    outwards: Array | None,
) -> Answer:
    live = question.live
    bound = limit_load(on, live)
    candidate = _candidate(on, live, bound)
    capacity = _capacity_of(on, live, bound, candidate)
    limit = capacity.limit
    facts: dict[str, Any] = {
        "name": question.name,
        "kind": "load",
        "meaning": str(live),
        "limit": _number(limit.multiplier),
        "limit_lost": _number(capacity.lost),
        "limit_sure": _number(capacity.sure),
        "limit_kind": capacity.kind,
        "bound": _number(bound.multiplier),
        "bound_kind": "associative friction, rigorous upper bound",
        "candidate": None if candidate is None else _number(candidate.multiplier),
        "candidate_kind": "Coulomb's friction without dilatancy, by cone programmes: the stones may fall at less",
        "candidate_lowest": None if candidate is None else _number(candidate.lowest.multiplier),
        "candidate_converged": None if candidate is None else candidate.converged,
        "candidate_sought": len(on.free) <= _SOUGHT,
        "outcome": _outcome(limit.multiplier),
    }
    if isinstance(live, Acceleration):
        changes = sensitivity(on, live, bound, outwards)
        facts["direction"] = list(live.direction)
        facts["sensitivity"] = None if changes is None else asdict(changes)
    facts["without_friction_across"] = _without_friction_across(on, live, limit)
    if question.whole and np.isfinite(limit.multiplier):
        facts["tilt"] = float(np.degrees(np.arctan(limit.multiplier)))
    # where the step from rest decides nothing, only runs can
    if not np.isnan(bound.multiplier) and (question.confirm or capacity.kind == _UNSURE):
        first = limit.multiplier if np.isfinite(limit.multiplier) else _FIRST
        facts["confirmation"] = _confirmed(on, confirming(live, first, bound.multiplier), limit)
        if facts["confirmation"]["lost"] is not None:
            facts["outcome"] = "limited"
    if isinstance(live, Acceleration) and np.isfinite(limit.multiplier):
        code = None if question.code is None or site is None else (question.code, site)
        facts["kinematics"], checked = _kinematics(
            on, live, _checked_limit(limit, capacity.lost, candidate), code
        )
        if checked:
            facts["code"] = checked
    curve = _led(live, limit, facts, leading) if question.pushover else None
    if curve is not None:
        facts["pushover"] = _capacity(curve)
    facts["headline"] = _sentence(facts)
    facts["mechanism"] = _moving(on, limit.mechanism)
    return Answer(facts, limit.mechanism, limit.force, curve)


def _without_friction_across(on: RigidAssembly, live: LiveLoad, candidate: LimitLoad) -> float | None:
    """Return λ without friction across the line of sliding [-]; None where it is the same.

    None, too, where stones do not slide along one line. Zero where the stones do not stand without it.
    """
    if (
        not np.isfinite(candidate.multiplier)
        or len(on.free) > _SOUGHT
        or not slides_along_one_line(on, candidate)
    ):
        return None
    frictionless = without_friction_across(on, live, candidate)
    if frictionless is None or np.isinf(frictionless.multiplier):
        return None
    multiplier = 0.0 if np.isnan(frictionless.multiplier) else frictionless.multiplier
    return multiplier if multiplier < (1.0 - _SAME) * candidate.multiplier else None


@dataclass(frozen=True)
class _Capacity:
    """Load that the stones bear.

    Attributes
    ----------
    limit : the load with its mechanism; as a rule the largest that a step from rest holds, and how the stones begin
        to fall under the least that it loses
    lost : least load factor that is lost [-]
    sure : load factor up to which no method or step decides [-]
    kind : what the limit is, in words
    """

    limit: LimitLoad
    lost: float
    sure: float
    kind: str


def _capacity_of(
    on: RigidAssembly, live: LiveLoad, bound: LimitLoad, candidate: LimitLoad | None
) -> _Capacity:
    if np.isnan(bound.multiplier):
        return _Capacity(bound, 0.0, 0.0, _BY_RUNS)
    if on.crushing is not None and candidate is not None:
        return _Capacity(candidate, bound.multiplier, candidate.multiplier, _CRUSHED)
    lowest = None if candidate is None or not candidate.converged else candidate.lowest.multiplier
    confirmed = held_limit(on, live, bound, lowest)
    if confirmed.lost == 0.0:
        limit = candidate or bound
        return _Capacity(limit, bound.multiplier, limit.multiplier, _UNSURE)
    limit = replace(
        bound,
        flow=Flow.COULOMB,
        multiplier=confirmed.held,
        force=confirmed.force,
        mechanism=confirmed.mechanism or bound.mechanism,
        programmes=confirmed.problems,
    )
    return _Capacity(limit, confirmed.lost, confirmed.sure, _BY_RUNS)


def _checked_limit(limit: LimitLoad, lost: float, candidate: LimitLoad | None) -> LimitLoad:
    """Return the load that a code checks: on the safe side, and by the mechanism of a programme where there is one."""
    if candidate is None or candidate.lowest.multiplier > (1.0 + WIDTH) * lost:
        return limit
    return candidate.lowest


def _led(live: LiveLoad, limit: LimitLoad, facts: dict[str, Any], leading: Lead) -> Pushover | None:
    """Return the capacity curve; None where no mechanism moves along the load."""
    if not np.isfinite(limit.multiplier):
        return None
    oscillator = facts.get("kinematics")
    try:
        return leading(live, limit, None if oscillator is None else oscillator["capacity"] or None)
    except SolverError:
        return None


def _capacity(curve: Pushover) -> dict[str, Any]:
    return {
        "control": curve.control,
        "direction": curve.direction.tolist(),
        "onset": curve.onset,
        "peak": _number(curve.peak),
        "dropped": _number(curve.falls_to(_DROP * curve.peak)),
        "capacity": _number(curve.falls_to(0.0)),
        "farthest": float(curve.displacement[-1]),
        "ended": curve.ended,
        "rate_error": float(np.abs(curve.inertia[curve.calm]).max(initial=0.0)),
        "hit": int((~curve.calm).sum()),
        "steps": curve.steps,
        "unsolved": curve.unsolved,
        "curve": {
            "displacement": curve.displacement.tolist(),
            "multiplier": curve.multiplier.tolist(),
            "inertia": curve.inertia.tolist(),
            "calm": curve.calm.tolist(),
        },
    }


def _candidate(on: RigidAssembly, live: LiveLoad, bound: LimitLoad) -> LimitLoad | None:
    """Return the candidate of Coulomb's friction; None where there is none to be found, or it would take too long."""
    if not np.isfinite(bound.multiplier) or len(on.free) > _SOUGHT:
        return None
    try:
        candidate = limit_load(on, live, Flow.COULOMB, bound)
    except SolverError:
        return None
    return candidate if np.isfinite(candidate.multiplier) else None


def _confirmed(on: RigidAssembly, confirmation: Confirmation, candidate: LimitLoad) -> dict[str, Any]:
    lost = confirmation.collapse
    alike = None if lost is None else likeness(on, candidate.mechanism, lost.displacement)
    return {
        "held": confirmation.held or None,
        "lost": _number(confirmation.lost),
        "agrees": confirmation.agrees(candidate.multiplier),
        "likeness": None if alike is None else asdict(alike),
        "runs": [
            {
                "multiplier": trial.multiplier,
                "outcome": str(trial.outcome),
                "steps": trial.steps,
                "unsolved": trial.unsolved,
            }
            for trial in confirmation.trials
        ],
        "undecided": sum(
            not trial.outcome.rests and trial.outcome is not Outcome.COLLAPSED
            for trial in confirmation.trials
        ),
    }


def _kinematics(
    on: RigidAssembly, live: Acceleration, limit: LimitLoad, code: tuple[str, Site] | None
) -> tuple[dict[str, Any] | None, dict[str, Any] | None]:
    """Return the equivalent oscillator of a mechanism, and its check by a code."""
    try:
        oscillator = kinematics(on, live, limit)
    except SolverError:
        return None, None
    facts = {
        "blocks": int(oscillator.block.max()) + 1,
        "weight": oscillator.weight,
        "mass": oscillator.mass,
        "mass_share": oscillator.share,
        "acceleration": oscillator.acceleration(),
        "capacity": _number(oscillator.capacity),
        "curve": {
            "displacement": oscillator.displacement.tolist(),
            "multiplier": oscillator.multipliers.tolist(),
        },
    }
    return facts, None if code is None else _checked(on, oscillator, *code)


def _checked(on: RigidAssembly, oscillator: Kinematics, code: str, site: Site) -> dict[str, Any]:
    limit = check_code(code, site, oscillator, float(np.linalg.norm(on.model.gravity(0.0))))
    return {
        "code": limit.code,
        "caution": limit.caution,
        "passed": limit.passed,
        "values": list(limit.values),
        "checks": [asdict(check) | {"ratio": check.ratio, "passed": check.passed} for check in limit.checks],
    }


def _thrust(on: RigidAssembly, question: ThrustQuestion) -> Answer:
    thrusts = thrust(on, question.supports, question.direction)
    x, y, z = thrusts.direction
    facts: dict[str, Any] = {
        "name": question.name,
        "kind": "settlement" if question.settles else "thrust",
        "meaning": f"push on {', '.join(question.supports)} along ({x:.3g}, {y:.3g}, {z:.3g}) [N]",
        "least": _number(thrusts.least.value),
        "greatest": _number(thrusts.greatest.value),
        "bounds_kind": "over all states of equilibrium: rigorous, whatever the flow",
        "outcome": _outcome(thrusts.least.value),
    }
    facts["headline"] = _range(facts)
    facts["mechanism"] = _moving(on, thrusts.least.mechanism)
    return Answer(facts, thrusts.least.mechanism, thrusts.least.force)


def _thickness(on: RigidAssembly, question: Thickness) -> Answer:
    safety = geometric_safety(on)
    falls = np.isnan(safety.share)
    facts: dict[str, Any] = {
        "name": question.name,
        "kind": "thickness",
        "meaning": "share to which all joints may shrink about their centres, weights unchanged",
        "factor": _number(safety.factor),
        "share": _number(safety.share),
        "outcome": FALLS if falls else "stands" if safety.share else "nothing limits it",
    }
    factor = "nothing limits it" if not falls and not safety.share else f"{safety.factor:.4g}"
    facts["headline"] = (
        f"{question.name}: {FALLS}" if falls else f"{question.name}: geometric factor of safety {factor}"
    )
    facts["mechanism"] = _moving(on, safety.mechanism)
    return Answer(facts, safety.mechanism, safety.force)


def _moving(on: RigidAssembly, mechanism: Mechanism) -> dict[str, Any]:
    """Return the stones that move, the fastest first, and how many joints open and slide."""
    moves = np.flatnonzero(mechanism.speed > _MOVES)
    return {
        "stones": [
            {
                "code": on.model.scene.blocks[row].code,
                "centre": on.state.centre[row].tolist(),
                "velocity": mechanism.velocity[row, :3].tolist(),
                "spin": mechanism.velocity[row, 3:].tolist(),
            }
            for row in moves[np.argsort(-mechanism.speed[moves], kind="stable")]
        ],
        "opening_joints": _joints(on, mechanism.opening),
        "sliding_joints": _joints(on, mechanism.sliding & ~mechanism.opening),
    }


def _joints(on: RigidAssembly, chosen: Any) -> int:
    return len(np.unique(np.sort(on.contacts.bodies[chosen], axis=1), axis=0))


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _outcome(value: float) -> str:
    if np.isnan(value):
        return FALLS
    return "nothing limits it" if np.isinf(value) else "limited"


def _sentence(facts: dict[str, Any]) -> str:
    if facts["outcome"] == FALLS:
        return f"{facts['name']}: λ = 0, as no forces in its joints balance the dead load"
    if facts["limit"] is None:
        return f"{facts['name']}: {facts['outcome']}{_dynamics(facts)}"
    lost = "" if facts["limit_lost"] is None else f"; {facts['limit_lost']:.4g} is lost"
    limit = "held" if facts["limit"] else "nothing beside the dead load is held"
    if facts["limit_sure"] < facts["limit"]:
        lost += f" by a step that is NOT SOLVED, and runs may fall from {facts['limit_sure']:.4g} on"
    how = {_CRUSHED: "candidate, as stones crush", _UNSURE: "NOT SURE, candidate or bound"}
    stands = how.get(facts["limit_kind"], f"{limit}{lost}")
    bound = "no bound" if facts["bound"] is None else f"bound {facts['bound']:.4g}"
    text = f"{facts['name']}: λ = {facts['limit']:.4g} ({stands}), {bound}{_caution(facts)}"
    across = facts["without_friction_across"]
    if across is not None:
        text += f"; without friction across the line of sliding, as wedges are computed, λ = {across:.4g}"
    angle = f", a tilt of {facts['tilt']:.3g}°" if "tilt" in facts else ""
    return f"{text}{angle}{_dynamics(facts)}{_collapse(facts)}{_verdict(facts)}"


def _caution(facts: dict[str, Any]) -> str:
    """Return what other forces of the same friction hold, if that is less, or that they were not sought."""
    if facts["bound"] is None:
        return ""
    if not facts["candidate_sought"]:
        return "; whether other forces hold less was not sought among so many stones"
    if facts["candidate"] is None:
        return "; whether other forces hold less was not found"
    if facts["limit"] <= _ONE * facts["candidate_lowest"]:
        return ""
    stood = "" if facts["candidate_converged"] else ", NOT CONVERGED"
    return f"; other forces of the same friction hold no more than {facts['candidate_lowest']:.4g}{stood}"


def _dynamics(facts: dict[str, Any]) -> str:
    if "confirmation" not in facts:
        return ""
    confirmation = facts["confirmation"]
    load = "nothing held" if confirmation["held"] is None else f"held at {confirmation['held']:.4g}"
    lost = "nothing lost" if confirmation["lost"] is None else f"lost at {confirmation['lost']:.4g}"
    agreement = ""
    if facts["limit"] is not None:
        agreement = " CONFIRMED" if confirmation["agrees"] else " NOT CONFIRMED"
    text = f"; by the dynamics{agreement}: {load}, {lost}"
    if confirmation["likeness"] is None:
        return text
    cosine = confirmation["likeness"]["cosine"]
    return f"{text}, falling {'as' if cosine >= _ALIKE else 'NOT AS'} the mechanism (cosine {cosine:.2f})"


def _collapse(facts: dict[str, Any]) -> str:
    if "pushover" not in facts:
        return ""
    pushed = facts["pushover"]
    doubt = f", {pushed['unsolved']} of {pushed['steps']} steps NOT SOLVED" if pushed["unsolved"] else ""
    if pushed["peak"] is None:
        return f"; led to collapse: moves at {pushed['onset']:.4g}, then stones hit one another throughout{doubt}"
    ways = [
        f"{name} after {1e3 * pushed[key]:.3g} mm"
        for key, name in (("dropped", "a fifth lost"), ("capacity", "all lost"))
        if pushed[key] is not None
    ]
    led = ", ".join(ways) or f"less than a fifth lost up to {1e3 * pushed['farthest']:.3g} mm"
    moves = f"moves at {pushed['onset']:.4g}, then bears {pushed['peak']:.4g}"
    return f"; led to collapse: {moves}, {led} of {pushed['control']}{doubt}"


def _verdict(facts: dict[str, Any]) -> str:
    if "code" not in facts:
        return ""
    check = facts["code"]
    caution = f" ({check['caution']})" if check["caution"] else ""
    return f"; {check['code']}: {'passed' if check['passed'] else 'NOT PASSED'}{caution}"


def _range(facts: dict[str, Any]) -> str:
    if facts["outcome"] == FALLS:
        return f"{facts['name']}: {FALLS}"
    least, greatest = (
        "without limit" if facts[end] is None else f"{1e-3 * facts[end]:.4g} kN"
        for end in ("least", "greatest")
    )
    if facts["kind"] == "settlement":
        return f"{facts['name']}: the push on the support falls to {least} as it yields"
    return f"{facts['name']}: from {least} to {greatest}"
