"""Pushover: the load that rigid stones bear as one of them is led farther and farther, to collapse.

The dynamics run under a load whose multiplier λ is changed from step to step so that one stone, which the mechanism of
a limit load moves fastest, goes on along the load at a small constant speed V. With the acceleration a of that stone in
the last step, and G, what λ beyond equilibrium adds to it,

    λ ← λ - a/G + (V - v)/(G T),

where T is a few steps; where nothing moves yet, λ grows slowly. The curve is that of intervals of the way: with the
live load q at λ = 1, the work of the load less what the kinetic energy grows,

    λ_rest = (Σ λ q·v h - ΔE) / Σ q·v h,

is what the stones would bear at rest, and ΔE / Σ q·v h the error of the rate, which is measured with it. Other than in
the kinematic curve (`mechanics.limit.kinematic`), stones slide, meet and part, and the mechanism may change on the way.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ground.errors import SolverError
from mechanics.arrays import Array, Bools
from mechanics.dynamics.observers.energy import mass_norm
from mechanics.dynamics.progress import Listener, Progress, silent
from mechanics.dynamics.simulation import Simulation
from mechanics.limit.assembly import RigidAssembly
from mechanics.limit.limit_load import LimitLoad
from mechanics.limit.live_loads import LiveLoad, levers
from mechanics.model.model import build_model
from mechanics.scene.loads.load import Force, Loads
from mechanics.scene.scene import Scene, TimeSettings

# speed at which the stone is led, over that of a fall through the way of the whole curve [-]
SPEED = 0.01
# steps in one interval of the curve, and of T
_PER_POINT, _STEPS = 16, 4.0
# largest change of λ in one step over the limit load, and that where nothing moves yet [-]
_CHANGE, _GROWTH = 0.1, 5e-4
# share of the limit load with which a run begins [-]
_BEGIN = 0.85
# steps without motion after which the stones cannot be led, and speed over V below which nothing moves [-]
_STILL, _STANDS = 800, 1e-2
# way of the whole curve over the least width of a stone that moves, where no better is known [-]
_REACH = 0.5
# what inertia may add to λ in a calm interval, over the limit load [-]
_CALM = 0.01


@dataclass(frozen=True)
class Pushover:
    """Capacity curve.

    Attributes
    ----------
    control : code of the stone that is led
    direction : (3,) along which its way is measured
    displacement : (n,) its way in the middle of each interval [m]
    multiplier : (n,) λ of the stones at rest there [-]
    inertia : (n,) what the kinetic energy took of the load, the error of the rate [-]
    onset : largest λ under which the stones stood before they gave way; 0: they moved at once, under 0.85 of the limit
    limit : λ of the limit load with whose mechanism the run began [-]
    ended : why the curve ends
    steps, unsolved : of the dynamics, and those that were not solved
    """

    control: str
    direction: Array
    displacement: Array
    multiplier: Array
    inertia: Array
    onset: float
    limit: float
    ended: str
    steps: int
    unsolved: int

    @property
    def calm(self) -> Bools:
        """Intervals (n,) whose λ inertia changes by no more than 1 % of the limit.

        In others the stone gathers speed, or stones hit one another.
        """
        calm: Bools = np.abs(self.inertia) <= _CALM * self.limit
        return calm

    @property
    def peak(self) -> float:
        """Largest λ of calm intervals; NaN without any [-]."""
        return float(self.multiplier[self.calm].max()) if self.calm.any() else float("nan")

    def falls_to(self, multiplier: float) -> float:
        """Return the way at which λ has fallen to a value after its peak; infinite where it does not [m]."""
        places, values = self.displacement[self.calm], self.multiplier[self.calm]
        below = np.flatnonzero(values <= multiplier)
        below = below[below > int(values.argmax())] if len(values) else below
        if not len(below):
            return float("inf")
        last = int(below[0])
        fraction = (values[last - 1] - multiplier) / (values[last - 1] - values[last])
        return float(places[last - 1] + fraction * (places[last] - places[last - 1]))


@dataclass(frozen=True)
class _Growing:
    """Live load whose multiplier is the clock of the scene: λ = t / 1 s.

    Attributes
    ----------
    stones : codes of the stones that it pushes
    force, arm : (n, 3) of each, in the order of the scene [N], and where it acts, axes of the start [m]
    """

    stones: frozenset[str]
    force: Array
    arm: Array
    until = 0.0
    course = None

    def __call__(self, time: float, centre: Array, rotation: Array) -> tuple[Array, Array]:
        """Return force and moment (n, 3) of all [N, N m]."""
        force = time * self.force
        return force, np.cross(np.einsum("nij,nj->ni", rotation, self.arm), force)


@dataclass(frozen=True)
class _Standing:
    """Load of the scene as it is at the start, whatever its clock shows."""

    load: Force
    until = 0.0
    course = None

    @property
    def stones(self) -> frozenset[str]:
        """Codes."""
        return self.load.stones

    def __call__(self, time: float, centre: Array, rotation: Array) -> tuple[Array, Array]:
        """Return force and moment (n, 3) of all [N, N m]."""
        return self.load(0.0, centre, rotation)


def pushover(
    on: RigidAssembly,
    live: LiveLoad,
    limit: LimitLoad,
    reach: float | None = None,
    points: int = 50,
    progress: Listener = silent,
    stop: Callable[[], bool] = lambda: False,
) -> Pushover:
    """Return the capacity curve under a live load.

    Parameters
    ----------
    on, live : the rigid stones, and the load
    limit : limit load, whose mechanism tells which stone is led: the one that moves fastest along the load
    reach : way to which the curve is expected to go; None: half of the least width of the stones that move [m]
    points : of the curve over that way; it goes on to twice as many
    progress, stop : called and asked at every point

    Raises
    ------
    SolverError : there is no mechanism along the load, or the stones do not move however large it is
    SceneError : see `build_model`
    """
    load = live(on).reshape(-1, 6)
    direction = load[:, :3].sum(axis=0)
    direction = direction / np.linalg.norm(direction)
    along = limit.mechanism.velocity[on.free, :3] @ direction
    if not np.isfinite(limit.multiplier) or not along.max(initial=0.0) > 0:
        raise SolverError(
            "no mechanism moves along the load", where=str(live), remedy="take a load that has one"
        )
    led = int(on.free[along.argmax()])
    moving = on.free[limit.mechanism.speed[on.free] > 1e-2]
    if reach is None:
        reach = _REACH * float(on.model.surfaces.size[moving].min())
    speed = SPEED * float(np.sqrt(2.0 * np.linalg.norm(on.model.gravity(0.0)) * reach))
    return _Run(on, load, led, direction, reach / points, speed).curve(limit, 2 * points, progress, stop)


class _Run:
    """Steps of a pushover.

    Parameters
    ----------
    on : the stones
    load : (n, 6) live load of the free stones at λ = 1 [N, N m]
    led, way : the body that is led, and the unit direction (3,)
    interval : way of one point of the curve [m]
    speed : V [m/s]
    """

    def __init__(
        self, on: RigidAssembly, load: Array, led: int, direction: Array, interval: float, speed: float
    ) -> None:
        self._load, self._free, self._led, self._direction = load, on.free, led, direction
        self._interval, self._speed = interval, speed
        self._step = interval / (_PER_POINT * speed)
        self._model, state = build_model(_scene(on, load, self._step))
        self._simulation = Simulation(self._model, state)

    def curve(
        self, candidate: LimitLoad, most: int, progress: Listener, stop: Callable[[], bool]
    ) -> Pushover:
        """Return the curve of at most so many intervals."""
        simulation, limit = self._simulation, candidate.multiplier
        begin = simulation.state.centre[self._led]
        gain = self._gain(candidate.mechanism.velocity)
        multiplier, speed, onset = _BEGIN * limit, 0.0, 0.0
        work = load_work = energy = 0.0
        path, values, inertia = [0.0], list[float](), list[float]()
        still = steps = unsolved = 0
        ended = ""
        while not ended:
            simulation.state = replace(simulation.state, time=multiplier)
            made = simulation.step()
            steps += 1
            unsolved += not made.solution.converged
            velocity = simulation.state.velocity
            power = self._step * self._power(velocity)
            work, load_work = work + power, load_work + multiplier * power
            before, speed = speed, float(velocity[self._led, :3] @ self._direction)
            moved = float((simulation.state.centre[self._led] - begin) @ self._direction)
            still = still + 1 if speed < _STANDS * self._speed else 0
            if still and not values:
                onset = max(onset, multiplier)
            if moved >= path[-1] + self._interval and work > 0.0:
                now = self._twice_energy(velocity) / 2.0
                inertia.append((now - energy) / work)
                values.append(load_work / work - inertia[-1])
                path.append(moved)
                work, load_work, energy = 0.0, 0.0, now
                text = f"λ {values[-1]:.4g} at {1e3 * moved:.3g} mm"
                progress(Progress("pushover", len(values), most, text))
            ended = self._end(values, most, still, stop)
            wanted = -(speed - before) / (self._step * gain) + (self._speed - speed) / (
                gain * _STEPS * self._step
            )
            most_up = (_GROWTH if still else _CHANGE) * limit
            multiplier += float(np.clip(wanted, -_CHANGE * limit, most_up))
        if not values:
            raise SolverError("the stones cannot be led along the load", where=self._code)
        places = 0.5 * (np.array(path[:-1]) + np.array(path[1:]))
        return Pushover(
            control=self._code,
            direction=self._direction,
            displacement=places,
            multiplier=np.array(values),
            inertia=np.array(inertia),
            onset=onset,
            limit=limit,
            ended=ended,
            steps=steps,
            unsolved=unsolved,
        )

    def _end(self, values: Sequence[float], most: int, still: int, stop: Callable[[], bool]) -> str:
        """Return why the curve ends here; empty where it goes on."""
        if stop():
            return "stopped"
        if len(values) > 1 and max(values[-2:]) <= 0.0:
            return "no load is borne any more"
        if still >= _STILL:
            return "the stones do not follow"
        return f"{most} points" if len(values) >= most else ""

    @property
    def _code(self) -> str:
        return self._model.scene.blocks[self._led].code

    def _gain(self, velocity: Array) -> float:
        """Return G, the acceleration of the stone per λ beyond equilibrium, of a mechanism (nb, 6) [m/s²]."""
        led = float(velocity[self._led, :3] @ self._direction)
        return led * self._power(velocity) / self._twice_energy(velocity)

    def _power(self, velocity: Array) -> float:
        """Return q·v of velocities (nb, 6) [W]."""
        return float((self._load * velocity[self._free]).sum())

    def _twice_energy(self, velocity: Array) -> float:
        """Return v·M v of velocities (nb, 6) [J]."""
        state = self._simulation.state
        return mass_norm(self._model, state.rotation, velocity, state.node_velocity)


def _scene(on: RigidAssembly, load: Array, step: float) -> Scene:
    """Return the scene of the steps: of its loads none changes with the clock but the one that λ multiplies."""
    scene = on.model.scene
    pushed, force, arm = levers(load)
    codes = frozenset(scene.blocks[body].code for body in on.free[pushed])
    x, y, z = on.model.gravity(0.0).tolist()
    forces: tuple[Force, ...] = (*map(_Standing, scene.loads.forces), _Growing(codes, force, arm))
    return replace(scene, gravity=(x, y, z), time=TimeSettings(step, theta=1.0), loads=Loads(forces=forces))
