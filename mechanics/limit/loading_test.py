"""Loading test: stones in a rig are pushed step by step, forwards and back, and the force on the jaws is the curve.

Each step moves the jaws by a stated way, at a speed that is a hundredth of that of a fall through the largest of them;
with θ = 1 what the stones gather of it in a step is gone in the next. The force that jaws bear at rest is theirs less
ΔE/Δu, what the kinetic energy took of their work; that is the error of the rate, and it is measured with the curve.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from ground.errors import SceneError, SolverError
from mechanics.arrays import Array, Bools, Ints
from mechanics.dynamics.energy_balance import EnergyBalance
from mechanics.dynamics.observers.energy import kinetic_energy
from mechanics.dynamics.observers.equilibrium import displacement
from mechanics.dynamics.progress import Listener, Progress, silent
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.static_start import static_start
from mechanics.dynamics.step import Step
from mechanics.limit.pushover import SPEED
from mechanics.model.model import Model, build_model
from mechanics.scene.loads.load import Pose
from mechanics.scene.rig import BEAM, JAWS, Rig, rigged
from mechanics.scene.scene import Scene, TimeSettings
from mechanics.scene.state import State


class JawPath:
    """Motion of jaws to given displacements in turn, at a constant speed; they rise with what they push.

    Parameters
    ----------
    stones : codes of the jaws
    direction : (3,) unit vector
    to : displacements in turn [m]
    speed : [m/s]

    Attributes
    ----------
    rise : of the jaws so far [m]
    course : None: a test runs to its end
    """

    course = None

    def __init__(self, stones: frozenset[str], direction: Array, to: Sequence[float], speed: float) -> None:
        self.stones, self._direction = stones, direction
        self._path = np.concatenate([[0.0], to])
        self._time = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(self._path)))]) / speed
        self.rise = 0.0

    @property
    def until(self) -> float:
        """Time at which they come to rest [s]."""
        return float(self._time[-1])

    def at(self, time: float) -> float:
        """Return the displacement at `time` [m]."""
        return float(np.interp(time, self._time, self._path))

    def pose(self, time: float) -> Pose:
        """Return the pose at `time` [s]."""
        return Pose(self.at(time) * self._direction + [0.0, 0.0, self.rise], np.eye(3), np.zeros(3))


# steps over the largest way, where no other step is asked for
_STEPS = 200
# steps over the displacement 2 G/c in which a bond softens: at the half of its strength it is seen once at least
_SOFTENING_STEPS = 2
# inertia over the largest force up to which a step is calm [-]
_CALM = 0.01
# of displacements, over the largest [-]
_DISPLACEMENT_ROUNDING = 1e-9
# shares of the largest force at which laboratories take secants [-]
_EARLY, _INITIAL = 0.15, 0.3
# stones that an error names: so many at most, of those that moved by this share of the largest displacement
_NAMED, _MOVES = 6, 0.5


@dataclass(frozen=True)
class LoadingTest:
    """Force and displacement of stones in a rig.

    Attributes
    ----------
    displacement : (n,) of the push at the end of each step, from the state of rest under the vertical force [m]
    force : (n,) on the jaws along the push [N]
    inertia : (n,) what the kinetic energy took of it, the error of the rate [N]
    lift : (n,) by which what is pushed has risen [m]
    rig, model : the rig; the stones with its pieces
    settled, peak, end : at rest under the vertical force; the steps with the largest force and the last one
    settling : largest displacement of a stone under the vertical force [m]
    unsolved : steps that were not solved
    energy_error : energy that no term explains over the largest in any term [-]
    stopped : ended before its way
    """

    displacement: Array
    force: Array
    inertia: Array
    lift: Array
    rig: Rig
    model: Model
    settled: State
    peak: Step
    end: Step
    settling: float
    unsolved: int
    energy_error: float
    stopped: bool

    @property
    def free(self) -> Bools:
        """Bodies (nb,) that are stones and not fixed."""
        return _stones(self.model)

    @property
    def calm(self) -> Bools:
        """Steps (n,) in which inertia changes the force by no more than 1 % of the largest."""
        calm: Bools = np.abs(self.inertia) <= _CALM * np.abs(self.force).max()
        return calm

    @property
    def strength(self) -> tuple[float, float]:
        """Largest force of calm steps forwards, and backwards as a negative number; 0 where none was pushed [N]."""
        force = np.append(np.where(self.calm, self.force, 0.0), 0.0)
        return float(force.max()), float(force.min())

    @property
    def stiffness(self) -> float:
        """Secant of the curve's first branch at 0.3 of the largest force [N/m]."""
        return self.secant(_INITIAL)

    @property
    def early_stiffness(self) -> float:
        """Secant of the curve's first branch at 0.15 of the largest force [N/m]."""
        return self.secant(_EARLY)

    def secant(self, share: float) -> float:
        """Return the secant of the curve's first branch at a share of the largest force [N/m]."""
        goal = share * np.abs(self.force).max()
        first = int(np.argmax(np.abs(self.force) >= goal))
        places, forces = np.insert(self.displacement, 0, 0.0), np.insert(self.force, 0, 0.0)
        before, after = np.abs(forces[first : first + 2])
        fraction = (goal - before) / (after - before)
        place = abs(places[first] + fraction * (places[first + 1] - places[first]))
        return float(goal / place)

    @property
    def first_branch(self) -> int:
        """Steps before the push turns for the first time, one at least."""
        back = np.flatnonzero(np.diff(np.abs(self.displacement)) < 0)
        return int(back[0]) + 1 if len(back) else len(self.displacement)

    def at(self, displacement: Array) -> Array:
        """Return the force at displacements (m,) on the first branch of the curve, NaN beyond its end [N]."""
        branch, sign = slice(self.first_branch), np.sign(self.displacement[self.first_branch - 1])
        places, forces = (
            np.insert(sign * self.displacement[branch], 0, 0.0),
            np.insert(self.force[branch], 0, 0.0),
        )
        asked = sign * displacement
        resisted: Array = np.interp(asked, places, forces, np.nan)
        return np.where(asked > places[-1] * (1.0 + _DISPLACEMENT_ROUNDING), np.nan, resisted)

    @property
    def turning(self) -> float:
        """Share of the displacement that comes of turning, of the median stone by mass: rocking 1, sliding 0 [-]."""
        model, end, stones = self.model, self.end.after, self.free
        spin = Rotation.from_matrix(end.rotation[stones] @ self.settled.rotation[stones].transpose(0, 2, 1))
        angle = spin.as_rotvec() @ self.rig.axes[1]
        order = np.argsort(angle)
        half = np.cumsum(model.mass[stones][order])
        middle = angle[order][np.searchsorted(half, half[-1] / 2)]
        return float(middle * self.rig.height / self.displacement[-1])


def _stones(model: Model) -> Bools:
    """Return the bodies (nb,) that are stones and not fixed."""
    stones: Bools = ~model.fixed & [block.code != BEAM for block in model.scene.blocks]
    return stones


class _Pushed:
    """Points of the stones, or of the beam, that jaws touched first.

    Parameters
    ----------
    step, jaws : the first step, and the bodies of the jaws
    start : state to which rises count
    """

    def __init__(self, step: Step, jaws: Ints, start: State) -> None:
        contacts = step.contacts
        side = np.isin(contacts.bodies, jaws)
        rows, touching = np.flatnonzero(side.any(axis=1)), side[side.any(axis=1)]
        column = np.where(touching[:, 0], 1, 0)
        self._body, self._arm = contacts.bodies[rows, column], contacts.arm[rows, column]
        self._start = self._height(start)

    def rise(self, state: State) -> float:
        """Return their mean rise [m]."""
        return self._height(state) - self._start if len(self._body) else 0.0

    def _height(self, state: State) -> float:
        place = state.centre[self._body] + np.einsum("nij,nj->ni", state.rotation[self._body], self._arm)
        return float(place[:, 2].mean()) if len(place) else 0.0


def loading_test(
    scene: Scene,
    rig: Rig,
    to: Sequence[float],
    step: float | None = None,
    progress: Listener = silent,
    stop: Callable[[], bool] = lambda: False,
) -> LoadingTest:
    """Push stones to displacements in turn, and return the force.

    Parameters
    ----------
    scene : the stones and their laws, without loads that change with time; its time settings are not used
    rig : where it is pushed
    to : displacements of the push, in turn; their signs are those of the rig's direction [m]
    step : way of one step; None: 1/200 of the largest displacement, or `softening_step` where that is less [m]
    progress, stop : called and asked at every step

    Raises
    ------
    SceneError, GeometryError : the rig, or the scene, cannot be built; a load changes with time; stones without a beam
        are pushed backwards
    SolverError : the stones do not come to rest under the vertical force, or the motion is no longer finite
    """
    _refuse_untestable(scene, rig, to)
    furthest = float(np.abs(to).max())
    increment = step or min(furthest / _STEPS, softening_step(scene))
    speed = SPEED * float(np.sqrt(2.0 * np.linalg.norm(scene.gravity) * furthest))
    path = JawPath(frozenset(JAWS if rig.has_beam else JAWS[:1]), rig.axes[0], to, speed)
    duration = increment / speed
    scene = replace(scene, time=TimeSettings(duration, theta=1.0, duration=path.until + duration))
    model, begin = build_model(rigged(scene, rig, path))
    simulation = _settled(model, begin, rig, progress)
    settled = simulation.state
    balance = EnergyBalance(model, settled)
    codes = [block.code for block in model.scene.blocks]
    jaws = np.array([codes.index(code) for code in sorted(path.stones)])
    steps = int(np.ceil(path.until / duration - _DISPLACEMENT_ROUNDING))
    rows: list[tuple[float, float, float, float]] = []
    unsolved, energy, peak = 0, kinetic_energy(model, settled), None
    pushed: _Pushed | None = None
    for number in range(1, steps + 1):
        made = simulation.step()
        balance(made)
        unsolved += not made.solution.converged
        pushed = pushed or _Pushed(made, jaws, settled)
        path.rise = pushed.rise(made.after)
        force, place = _reaction(made, jaws, rig.axes[0]), path.at(made.after.time)
        moved, before, energy = place - path.at(made.before.time), energy, kinetic_energy(model, made.after)
        if peak is None or abs(force) > max(abs(row[1]) for row in rows):
            peak = made
        rows.append((place, force, (energy - before) / moved if moved else 0.0, path.rise))
        progress(Progress("push", number, steps, f"{force / 1e3:.4g} kN at {1e3 * place:.4g} mm"))
        if number < steps and stop():
            break
    displacement, force_, inertia, lift_ = np.array(rows).T
    assert peak is not None
    return LoadingTest(
        displacement,
        force_,
        inertia,
        lift_,
        rig,
        model,
        settled,
        peak,
        made,
        float(np.linalg.norm(settled.centre - begin.centre, axis=1).max()),
        unsolved,
        balance.error,
        number < steps,
    )


def _settled(model: Model, begin: State, rig: Rig, progress: Listener) -> Simulation:
    """Return a simulation that begins at rest under the vertical force, before the push."""
    start, search = static_start(_loaded(model, rig), begin, progress)
    if not start.found:
        raise _restless(model, begin, search.state)
    simulation = Simulation(model, begin)
    simulation.take_over(search)
    return simulation


def _refuse_untestable(scene: Scene, rig: Rig, to: Sequence[float]) -> None:
    """Refuse loads that change with time, and stones without a beam that are pushed backwards."""
    if scene.loads.until > 0:
        raise SceneError(
            "a load that changes with time",
            where=scene.name,
            remedy="leave it out: the test is at rest but for its push",
        )
    if not rig.has_beam and min(to) < 0:
        raise SceneError(
            "a push backwards without a beam",
            where="rig",
            remedy="give displacements of one sign, or turn the direction",
        )


def _loaded(model: Model, rig: Rig) -> Model:
    """Return the model whose rest is judged by what its stones carry: their weight and the force on their top."""
    scene = model.scene
    weight = float(model.mass[_stones(model)].sum() * np.linalg.norm(scene.gravity))
    carried = 1.0 + rig.load / weight if weight > 0 else 1.0
    time = replace(scene.time, balance_tolerance=carried * scene.time.balance_tolerance)
    return replace(model, scene=replace(scene, time=time))


def softening_step(scene: Scene) -> float:
    """Return the longest step that resolves the softening of all bonds, from 2 G/c; infinite where none soften [m]."""
    laws = (scene.contact.law, *(rule.law for rule in scene.contact.rules))
    return min(law.softening for law in laws) / _SOFTENING_STEPS


def _restless(model: Model, begin: State, now: State) -> SolverError:
    """Return the error that names the stones which have moved most, with their places."""
    moved = np.where(_stones(model), displacement(model, begin, now), 0.0)
    order = [k for k in np.argsort(-moved).tolist() if moved[k] >= _MOVES * moved.max()]
    names = ", ".join(
        f"{model.scene.blocks[k].code} at ({', '.join(f'{x:.2f}' for x in begin.centre[k])}) m by "
        f"{1e3 * moved[k]:.3g} mm"
        for k in order[:_NAMED]
    )
    more = f" and {len(order) - _NAMED} more" if len(order) > _NAMED else ""
    return SolverError(
        f"the stones do not come to rest under the vertical force; still moving or fallen: {names}{more}",
        where=model.scene.name,
        remedy="look there for joints that are steep, weak or of little area (`moma check SCENE --pictures DIR` draws "
        "them), and lower the load, or raise friction and strengths",
    )


def _reaction(step: Step, jaws: Array, along: Array) -> float:
    """Return the force of jaws on what they push, along the push [N]."""
    side = np.isin(step.contacts.bodies, jaws)
    sign = side[:, 1].astype(float) - side[:, 0]
    return float(sign @ (step.force @ along))
