"""Confirmation of a limit load by the dynamics: the load comes at once on stones at rest, and they hold or fall.

*Held*: the run ends at rest, every stone in balance by forces that arise from nothing. *Lost*: it does not, or the load
is the bound of associative friction. Between the largest load that is held and the least that is lost lies the limit of
the dynamics from rest; a load that grows slowly may be held up to 6 % further, or less far, as friction without
dilatancy has no unique limit.

How alike the mechanism of a candidate and the collapse of the dynamics are says the cosine between the velocities v of
the one and the displacements d of the other, of the centres of all stones, weighted by mass:

    Σ m v·d / √(Σ m v² · Σ m d²)
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from mechanics.arrays import Array, Bools
from mechanics.dynamics.outcome import Outcome
from mechanics.dynamics.progress import Listener, silent
from mechanics.limit.assembly import RigidAssembly
from mechanics.limit.limit_load import Mechanism
from mechanics.limit.live_loads import LiveLoad
from mechanics.scene.scene import TimeSettings
from mechanics.simulate import simulate

# load that is lost over that which is held at the end [-]
_LOAD_ACCURACY = 0.03
# step in which a stone falls by this share of the least width, and steps of a run at most
_FALL, _STEPS = 2.5e-3, 500
# move over its width from which a stone that falls has collapsed [-]
_MOVED = 0.05
# way over that of the stone that moves farthest from which a stone belongs to a collapse [-]
_BELONGS = 0.1


@dataclass(frozen=True)
class ConfirmationRun:
    """One run.

    Attributes
    ----------
    multiplier : λ [-]
    outcome : of the run
    steps : of it
    unsolved : steps of it that were not solved
    displacement : (nb, 3) of the centres of the stones' corners at its end [m]
    """

    multiplier: float
    outcome: Outcome
    steps: int
    unsolved: int
    displacement: Array


@dataclass(frozen=True)
class Confirmation:
    """Loads that the dynamics hold and that they lose.

    Attributes
    ----------
    held : largest λ that is held; 0: none [-]
    lost : least λ that is lost, the bound included; infinite: none [-]
    trials : the runs, in their order
    """

    held: float
    lost: float
    trials: tuple[ConfirmationRun, ...]

    @property
    def collapse(self) -> ConfirmationRun | None:
        """Run of the least load that collapses; None where none does."""
        fallen = [trial for trial in self.trials if trial.outcome is Outcome.COLLAPSED]
        return min(fallen, key=lambda run: run.multiplier, default=None)

    def agrees(self, candidate: float) -> bool:
        """Return True if the limit of the dynamics lies within 3 % of a candidate."""
        return (
            self.held >= (1.0 - _LOAD_ACCURACY) * candidate - 1e-12
            and self.lost <= (1.0 + _LOAD_ACCURACY) * candidate + 1e-12
        )


@dataclass(frozen=True)
class Likeness:
    """Comparison of the mechanism of a candidate with the collapse of the dynamics.

    Attributes
    ----------
    cosine : between velocities and displacements, weighted by mass [-]
    mechanism, collapse : share of the mass that moves in each, with more than a tenth of the largest motion [-]
    common : mass that moves in both, over the mass that moves in either [-]
    """

    cosine: float
    mechanism: float
    collapse: float
    common: float


def likeness(on: RigidAssembly, mechanism: Mechanism, displacement: Array) -> Likeness:
    """Return how alike a mechanism and the displacements (nb, 3) of a collapse [m] are."""
    mass, centre = on.model.mass[on.free], on.state.centre[on.free]
    corners = [on.model.scene.blocks[body].vertices.mean(axis=0) for body in on.free]
    velocity = mechanism.velocity[on.free]
    moves = velocity[:, :3] + np.cross(velocity[:, 3:], np.array(corners) - centre)
    falls = displacement[on.free]
    both = float(np.sqrt((mass @ (moves**2).sum(axis=1)) * (mass @ (falls**2).sum(axis=1))))
    in_mechanism, in_collapse = _belongs(moves), _belongs(falls)
    return Likeness(
        cosine=float(mass @ (moves * falls).sum(axis=1)) / (both or 1.0),
        mechanism=float(mass[in_mechanism].sum() / mass.sum()),
        collapse=float(mass[in_collapse].sum() / mass.sum()),
        common=float(
            mass[in_mechanism & in_collapse].sum() / (mass[in_mechanism | in_collapse].sum() or 1.0)
        ),
    )


def _belongs(motion: Array) -> Bools:
    size = np.linalg.norm(motion, axis=1)
    moves: Bools = size > _BELONGS * size.max(initial=0.0)
    return moves


def confirm(
    on: RigidAssembly,
    live: LiveLoad,
    candidate: float,
    bound: float = np.inf,
    runs: int = 12,
    progress: Listener = silent,
    stop: Callable[[], bool] = lambda: False,
) -> Confirmation:
    """Return what the dynamics hold and lose, within 3 % of each other: first at a candidate, then beside it.

    Parameters
    ----------
    on, live : the rigid stones, which stand without the load, and the load
    candidate : λ with which to begin [-]
    bound : λ that no stones bear, and which is lost without a run [-]
    runs : at most
    progress, stop : of every run, see `simulate`

    Raises
    ------
    SceneError, SolverError : see `simulate`
    """
    trials: list[ConfirmationRun] = []
    carried, lost, step = 0.0, bound, _LOAD_ACCURACY
    multiplier = min(candidate, bound)
    while len(trials) < runs and not stop() and lost > (1.0 + _LOAD_ACCURACY) * carried:
        trial = _trial(on, live, multiplier, progress, stop)
        trials.append(trial)
        if trial.outcome.rests:
            carried = multiplier
        else:
            lost = multiplier
        if carried == 0.0:
            multiplier, step = multiplier * max(1.0 - step, 0.5), 2.0 * step
        elif np.isinf(lost):
            multiplier, step = multiplier * (1.0 + step), 2.0 * step
        else:
            # next to the candidate first, half-way later on
            multiplier = min(0.5 * (carried + lost), carried * (1.0 + step))
            step *= 2.0
    if np.isfinite(lost) and all(trial.outcome.rests for trial in trials) and not stop():
        # how stones fall beyond the bound
        trials.append(_trial(on, live, (1.0 + _LOAD_ACCURACY) * lost, progress, stop))
    return Confirmation(carried, float(lost), tuple(trials))


def _trial(
    on: RigidAssembly,
    live: LiveLoad,
    multiplier: float,
    progress: Listener,
    stop: Callable[[], bool],
) -> ConfirmationRun:
    width = float(on.model.surfaces.size[on.free].min())
    step = float(np.sqrt(2.0 * _FALL * width / np.linalg.norm(on.model.gravity(0.0))))
    time = TimeSettings(step, theta=1.0, duration=_STEPS * step, collapse_displacement=_MOVED)
    loaded = replace(live.applied(on, multiplier), time=time)
    result = simulate(loaded, progress, stop=stop)
    displacement = np.array([body.displacement.mean(axis=0) for body in result.bodies])
    return ConfirmationRun(
        multiplier, result.outcome, result.steps, result.errors.unconverged_steps, displacement
    )
