"""Criteria by which a run ends, and the words in which its outcome is given."""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array, Bools
from mechanics.carried import Carrier
from mechanics.dynamics.observers.equilibrium import (
    displacement,
    seen_from_supports,
    speed,
    tilt,
)
from mechanics.dynamics.outcome import Outcome, StaticStart
from mechanics.dynamics.rest.relaxation import relaxation_caution
from mechanics.dynamics.step import Step
from mechanics.dynamics.verdicts.doubt import UnsolvedSteps, length
from mechanics.dynamics.verdicts.lasting import LASTING, fall_speed, moves, rest_speed
from mechanics.model.model import Model
from mechanics.scene.laws.law import BOND
from mechanics.scene.state import State

MOVED = 0.01  # displacement over a stone's width from which it does not stand as it is drawn [-]
_FALL_SPEED = 0.05  # of the same speed, above which a body falls [-]
_TOPPLED = np.pi / 4  # tilt from which a stone at rest away from its place has toppled [rad]
_LEANS = np.radians(10.0)  # tilt from which one that has sunk by half a collapse has toppled [rad]
_UNFILLED = 0.01  # area of joints that mortar does not fill, over that which it was to fill, that is told [-]
_LOWER = 0.7  # way along the load over the whole way from which a stone has sunk rather than moved aside [-]
_SELF_STRESS = "held only by self-stress, which no load applies: rigid joints admit this rest and a motion"


@dataclass(frozen=True)
class Verdict:
    """Outcome with its reason and its cautions, as `Result` has them."""

    outcome: Outcome
    reason: str
    cautions: tuple[str, ...]


class Watch(Carrier):
    """Outcome of a run, judged after each step.

    *Equilibrium*: for five steps in a row, solved, and after all loads have ceased to change, every body that is not
    fixed is in balance (unbalanced force and moment below the scene's tolerance), slower than 10⁻⁴ √(g · its width) and
    than a thousandth of its width in the time of the dashpots, and within 1 % of its width from where it began.
    *Settled*: the same, but farther away. *Collapsed*: a body has sunk, along the load that acts on it, by more than
    the scene's fraction of its width, and is faster than 0.05 √(g · width); or it has come to rest after such a fall,
    or after toppling. A body that rocks lifts its centre, one that slides slowly keeps its support: both move, and may
    still come to rest. *Undecided*: steps that were not solved may have added as much velocity as the motion has; or a
    rest that was disproved came back at the same place; or no step could be solved.
    The first proven collapse is final, whatever the stones do later. At the end of the time, stones that have fallen or
    toppled and lie still against the supports have collapsed, also while loads change.
    Without gravity g counts as 1 m/s². Displacements and speeds are relative to the supports where these are driven.
    Steps with compliant joints count as solved, and are told.

    Parameters
    ----------
    model, start : of the run

    Attributes
    ----------
    rest_time : start of the present or last period of rest [s]
    """

    CARRIED = (
        "_clamped", "_collapse", "_comes_back", "_compliant", "_culprit", "_deepest", "_depth", "_doubted", "_fastest",
        "_moved", "_pair", "_quiet", "_speed", "_steps", "_still", "_still_steps", "_sunk", "_time", "_unbonded",
        "_unsolved", "rest_time",
    )  # fmt: skip
    REBUILT = ("_model", "_start")

    def __init__(self, model: Model, start: State) -> None:
        self._model, self._start = model, start
        self._quiet = self._steps = 0
        self._fastest = 0.0
        self._unsolved = UnsolvedSteps(model)
        self._still = False
        self._culprit, self._sunk, self._moved, self._speed = 0, 0.0, 0.0, 0.0
        self._clamped = self._comes_back = False
        self._doubted = start
        # stone, how far it had sunk [m], its speed [m/s] and the time [s]
        self._collapse: tuple[int, float, float, float] | None = None
        self._still_steps = np.zeros(len(model.mass), dtype=np.int64)
        self._time = start.time
        self._compliant, self._deepest, self._depth, self._pair = 0, 0.0, 0.0, (0, 0)
        self._unbonded: tuple[str, ...] = ()
        self.rest_time = 0.0

    def __call__(self, step: Step, balance: Array) -> Outcome:
        """Return the outcome so far, from a step and the imbalance of each body (nb,) after it."""
        model, state, solution = self._model, step.after, step.solution
        self._steps += 1
        self._time = state.time
        self._unsolved(step)
        self._see_joints(step)
        if self._steps == 1:
            self._unbonded = _unbonded(model, step)
        seen = seen_from_supports(model, self._start, state)
        speeds = np.where(model.fixed, 0.0, speed(model, seen))
        pace = speeds / fall_speed(model, state)
        self._fastest = max(self._fastest, float(speeds.max()))
        slow = speeds <= rest_speed(model, state)
        self._still_steps = np.where(slow, self._still_steps + 1, 0)
        balanced = bool(balance.max() <= model.scene.time.balance_tolerance)
        still = state.time >= model.scene.loads.until and balanced and bool(slow.all())
        self._still = still and not solution.converged
        self._quiet = self._quiet + 1 if still and solution.converged else 0
        if self._quiet == 1:
            self.rest_time = state.time
        limit = model.scene.time.collapse_displacement * model.surfaces.size
        sunk = self._sinking(step, seen)
        fallen = ~model.fixed & (sunk > limit)
        falling = fallen & (pace > _FALL_SPEED)
        if self._collapse is not None:
            self._culprit = self._collapse[0]
            self._sunk, self._speed = float(sunk[self._culprit]), float(speeds[self._culprit])
            return Outcome.COLLAPSED
        if falling.any():
            proven = falling & ~np.array([self._unsolved.may_cause(fastest) for fastest in speeds])
            self._blame(proven if proven.any() else falling, sunk, speeds)
            if not proven.any():
                return Outcome.UNDECIDED
            self._collapse = self._culprit, self._sunk, self._speed, state.time
            return Outcome.COLLAPSED
        if self._quiet >= LASTING or self._ends:
            fallen |= self._toppled(seen, sunk, limit)
            lies = fallen & (self._still_steps >= LASTING)
            if lies.any() and (self._quiet >= LASTING or not self._unsolved.may_cause(self._fastest)):
                self._blame(lies, sunk, speeds)
                return Outcome.COLLAPSED
        self._culprit = int(speeds.argmax())
        self._speed = float(speeds[self._culprit])
        if self.hopeless:
            return Outcome.UNDECIDED
        if self._quiet < LASTING:
            return Outcome.MOVING
        moved = np.where(model.fixed, 0.0, displacement(model, self._start, seen))
        share = moved / model.surfaces.size
        self._culprit = int(share.argmax())
        self._sunk, self._moved = float(sunk[self._culprit]), float(moved[self._culprit])
        return Outcome.SETTLED if share[self._culprit] > MOVED else Outcome.EQUILIBRIUM

    @property
    def hopeless(self) -> bool:
        """True where so far no step was solved, and errors may have caused the motion."""
        return self._unsolved.hopeless(self._fastest)

    @property
    def _ends(self) -> bool:
        """True where the time of the run is over."""
        return self._steps >= self._model.scene.time.steps

    def disproved(self, rest: Outcome, state: State, surely: bool) -> Outcome:
        """Return the outcome of a rest that did not last once its forces were forgotten.

        *Moving*, the first time. One that comes back to the same place was found again without leaving it, and stays;
        but where forces that arise from nothing `surely` move its stones it is *undecided*: rigid joints admit both.
        """
        back = self._clamped and not moves(self._model, self._doubted, state)
        if back and not surely:
            return rest
        self._quiet, self._clamped, self._comes_back, self._doubted = 0, True, back, state
        return Outcome.UNDECIDED if back else Outcome.MOVING

    def verdict(self, outcome: Outcome, static: StaticStart | None) -> Verdict:
        """Return the outcome in words, from that of the last step, and the static start."""
        if outcome is Outcome.MOVING and (self._still or self._unsolved.may_cause(self._fastest)):
            outcome = Outcome.UNDECIDED
        cautions = [*self._gave_way(), *self._unbonded]
        if self._clamped and not self._comes_back and outcome is not Outcome.EQUILIBRIUM:
            cautions.insert(0, "a rest on the way was held only by self-stress, which no load applies")
        if outcome is Outcome.MOVING:
            cautions.insert(0, "whether it stands is not decided: its time was over before it rested or fell")
        if outcome.rests and self._unsolved.may_cause(self._fastest):
            cautions.append(f"on the way {self._unsolved.text()}")
        if (left_out := relaxation_caution(self._model)) is not None:
            cautions.append(left_out)
        if static is not None and not static.found:
            cautions.append("no static equilibrium was found: the run began at rest, all loads at once")
        return Verdict(outcome, self._reason(outcome), tuple(cautions))

    def _reason(self, outcome: Outcome) -> str:
        code = self._model.scene.blocks[self._culprit].code
        if outcome is Outcome.UNDECIDED:
            if self._comes_back:
                return _SELF_STRESS
            return self._unsolved.surrender() if self.hopeless else self._unsolved.text()
        if outcome is Outcome.MOVING:
            return f"stone {code} moves at {length(self._speed)}/s"
        if outcome is Outcome.SETTLED:
            share = _percent(self._moved / float(self._model.surfaces.size[self._culprit]))
            lower = self._sunk > _LOWER * self._moved
            distance = f"{length(self._sunk)} lower" if lower else f"{length(self._moved)} away"
            return (
                f"it does not stand as surveyed: stone {code} came to rest {distance}, {share} of its width"
            )
        if outcome is Outcome.COLLAPSED and self._collapse is not None and self._time > self._collapse[3]:
            _, sunk, pace, time = self._collapse
            end = (
                f"at the end it is {length(self._sunk)} lower"
                if self._sunk > 0
                else "at the end it is no lower"
            )
            return f"stone {code} had sunk by {length(sunk)} after {time:.3g} s and moved at {length(pace)}/s; {end}"
        if outcome is Outcome.COLLAPSED and self._collapse is None:
            return f"stone {code} has fallen or toppled, and lies {length(max(self._sunk, 0.0))} lower"
        if outcome is Outcome.COLLAPSED:
            return f"stone {code} has sunk by {length(self._sunk)} and moves at {length(self._speed)}/s"
        return ""

    def _see_joints(self, step: Step) -> None:
        """Remember how far compliant joints let stones into each other."""
        compression = step.compression
        self._compliant += step.gave_way is not None
        self._depth = float(compression.max(initial=0.0))
        if self._depth > self._deepest:
            self._deepest = self._depth
            first, second = step.found.contacts.bodies[int(compression.argmax())]
            self._pair = int(first), int(second)

    def _gave_way(self) -> list[str]:
        """Return a caution that states the compliance of the joints, if any step needed it."""
        if not self._compliant:
            return []
        first, second = (self._model.scene.blocks[body].code for body in self._pair)
        end = f"{length(self._depth)} at the end" if self._depth > 0 else "rigid again at the end"
        return [
            f"joints gave way elastically in {self._compliant} of {self._steps} steps, which rigid joints did not "
            f"solve: stones overlap by at most {length(self._deepest)} for it ({first} and {second}; {end})"
        ]

    def _sinking(self, step: Step, seen: State) -> Array:
        """Return how far each body (nb,) has moved along its present load, weight included [m]."""
        weight = self._model.mass[:, None] * self._model.gravity(seen.time)
        load = np.where(self._model.elastic[:, None], weight, step.kick.load[:, :3])
        size = np.linalg.norm(load, axis=1)
        along = np.einsum("bi,bi->b", seen.centre - self._start.centre, load)
        sunk: Array = np.divide(along, size, out=np.zeros_like(size), where=size > 0)
        return sunk

    def _toppled(self, seen: State, sunk: Array, limit: Array) -> Bools:
        """Return the bodies (nb,) that have tilted and left their place; balls may roll."""
        tilted = tilt(self._model, self._start, seen)
        leans: Bools = (tilted > _LEANS) & ~self._model.fixed
        if not leans.any():
            return leans
        leans &= np.array([block.radius is None for block in self._model.scene.blocks])
        away = displacement(self._model, self._start, seen) > limit
        return leans & np.where(tilted > _TOPPLED, away, sunk > 0.5 * limit)

    def _blame(self, bodies: Bools, sunk: Array, speeds: Array) -> None:
        """Remember the body that has sunk furthest over its width."""
        self._culprit = int(np.where(bodies, sunk / self._model.surfaces.size, -np.inf).argmax())
        self._sunk, self._speed = float(sunk[self._culprit]), float(speeds[self._culprit])


def _unbonded(model: Model, step: Step) -> tuple[str, ...]:
    """Return a caution on mortar that was to hold joints, but fills too little of them in the first step."""
    contacts, internal = step.contacts, step.internal
    meant = model.laws.makes_bonds(model.laws.of(contacts.bodies)) & (contacts.area > 0)
    wide = np.flatnonzero(meant & (internal[:, BOND] == 0))
    share = float(contacts.area[wide].sum() / (contacts.area[meant].sum() or 1.0))
    if share < _UNFILLED:
        return ()
    gap = np.abs(step.gap[wide])
    first, second = (model.scene.blocks[body].code for body in sorted(contacts.bodies[wide[gap.argmax()]]))
    return (
        f"mortar does not hold {_percent(share)} of the area of its joints, where gaps or overlaps exceed a hundredth "
        f"of the smaller stone's width ({first} and {second}: {length(float(gap.max()))})",
    )


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %" if share < 1.0 else f"{100.0 * share:.0f} %"
