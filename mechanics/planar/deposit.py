"""Samples of disks: pushed apart in a box, let fall, cut to a profile, and left to come to rest."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ground.errors import SceneError
from mechanics.arrays import Array, Bools
from mechanics.dynamics.progress import Listener, Progress, silent
from mechanics.planar.contacts import PlanarDetector
from mechanics.planar.delassus import PlanarDelassus
from mechanics.planar.measures.surface import profile
from mechanics.planar.model import build_planar_model
from mechanics.planar.run import PlanarRun
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime, Wall
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import Method, SolverSettings
from mechanics.solvers.first_order.disk_admm import DiskADMM

_NARROWEST = 4.0  # length and height of a sample over the largest radius, at least [-]
_MOST_DISKS = 2_000_000  # of a sample: more do not fit into the memory of most machines
_LOW = 2.0  # of the surface below the profile over the width of the largest disk, at most [-]
_GENTLE = 0.15  # slope of what is filled above the profile, half that at which disks flow [-]
_PLACES = 1001  # places along x at which it is known
_SOLID = 0.83  # share that settled disks fill, about
_PACKED = 0.78  # share that they fill before they fall
_ROOM = 1.06  # height that is filled, at rest, over that of the profile; and a large disk more
_TOUCHING = 0.005  # overlap over the smallest radius up to which disks are not pushed apart
_PUSHES = 200  # times that disks are pushed apart, at most
_PUSH = 100  # sweeps of each
_FALL = 0.05  # step in which a disk falls by this share of the smallest radius from rest
_FALLING = (
    0.8  # kept of the velocities after each step: disks fall no farther in one than about half their radius
)
_RESTING = 0.5  # the same while they come to rest
_CALM = 0.2  # mean speed over √(g r) at which falling disks are as dense as they become
_SLOW = 2e-3  # the same at which they have come to rest
_FEWEST, _MOST = 5, 1000  # steps of each of the stages
_DENSER = 5.0  # times that speed, up to which they come to rest with the friction of the fall
_FLOWING = 100  # steps of that stage, at most: a slope too steep for that friction flows on
_SWEEPS = 100  # of each step while they fall
# while they come to rest: η, and iterations and penalty of ADMM, which carries a weight through a hundred rows at once
_TOLERANCE, _ITERATIONS, _PENALTY = 1e-5, 200, 0.05


@dataclass(frozen=True)
class Deposit:
    """Sample to make.

    Attributes
    ----------
    length : of the box, x from 0 [m]
    top : height of the surface at places along x, to which the sample is cut [m]
    highest : largest value of `top` [m]
    smallest, largest : radii, evenly distributed between them [m]
    density : [kg/m³]
    friction : between disks, and with the box
    falling_friction : the same while they fall; less makes the sample denser (0.1: 0.83 of the area, 0.4: 0.80)
    seed : of the radii and places
    gravity : downwards [m/s²]
    large_share : part of the disks that have the largest radius, the others the smallest; None: evenly distributed
    rolling : disks turn
    """

    length: float
    top: Callable[[Array], Array]
    highest: float
    smallest: float
    largest: float
    density: float
    friction: float
    falling_friction: float
    seed: int = 1
    gravity: float = 9.81
    large_share: float | None = None
    rolling: bool = True

    def __post_init__(self) -> None:
        for quantity, value, ok, remedy in (
            (
                "smallest radius",
                self.smallest,
                0 < self.smallest <= self.largest,
                "give 0 < smallest ≤ largest",
            ),
            (
                "length",
                self.length,
                self.length > _NARROWEST * self.largest,
                f"give more than two of the widest disks, {_NARROWEST * self.largest:g} m, or smaller disks",
            ),
            (
                "highest",
                self.highest,
                self.highest > _NARROWEST * self.largest,
                f"give more than two of the widest disks, {_NARROWEST * self.largest:g} m, or smaller disks",
            ),
            ("gravity", self.gravity, self.gravity > 0, "give m/s² greater than 0: the disks fall"),
        ):
            if not ok:
                raise SceneError(f"{quantity} = {value!r}", where="sample", remedy=remedy)


def deposit(asked: Deposit, progress: Listener = silent) -> tuple[Array, Array]:
    """Return centres (nd, 2) and radii (nd,) of a sample at rest [m].

    Disks of random sizes at random places are pushed apart, and fall. Once they are dense, overlaps of the fall are
    undone, the disks that reach above the profile are taken away, and the others come to rest.

    Raises
    ------
    SceneError : the sample needs more disks than there may be, or what settles does not reach the profile
    """
    centre, radius = _packed(asked)
    centre = _apart(asked, _fallen(asked, centre, radius, progress), radius)
    _refuse_low(asked, centre, radius)
    keep = _below(asked, centre, radius)
    centre, radius = centre[keep], radius[keep]
    return _rested(asked, centre, radius, progress), radius


def _refuse_low(asked: Deposit, centre: Array, radius: Array) -> None:
    places = np.linspace(asked.largest, asked.length - asked.largest, _PLACES)
    reached, wanted = np.nan_to_num(profile(centre, radius, places)), asked.top(places)
    worst = int(np.argmax(wanted - reached))
    if wanted[worst] - reached[worst] > 2.0 * _LOW * asked.largest:
        raise SceneError(
            f"at x = {places[worst]:.4g} m the settled disks reach {reached[worst]:.4g} m, the profile is "
            f"{wanted[worst]:.4g} m high",
            where="sample",
            remedy="take smaller disks, of more similar sizes, or a longer sample; these settled too densely",
        )


def _below(asked: Deposit, centre: Array, radius: Array) -> Bools:
    return np.asarray(centre[:, 1] + radius <= asked.top(centre[:, 0]))


def _packed(asked: Deposit) -> tuple[Array, Array]:
    """Lay disks out, one anywhere in each place of a grid, and push them apart."""
    rng = np.random.default_rng(asked.seed)
    small, large, share = asked.smallest, asked.largest, asked.large_share
    if share is None:
        mean = np.pi * (small**2 + small * large + large**2) / 3.0
    else:
        mean = np.pi * ((1.0 - share) * small**2 + share * large**2)
    wide = float(np.sqrt(mean / _PACKED))
    needed = _SOLID * asked.length * (_ROOM * asked.highest + 2.0 * large) / mean
    if needed > _MOST_DISKS:
        raise SceneError(
            f"{needed:.3g} disks of {small:g} to {large:g} m are needed to fill "
            f"{asked.length:g} × {asked.highest:g} m; at most {_MOST_DISKS:,} are taken",
            where="sample",
            remedy="take larger disks, or a smaller sample",
        )
    columns = int(np.ceil(asked.length / wide))
    row, column = np.indices((int(np.ceil(needed / columns)), columns)).reshape(2, -1)
    radius = rng.uniform(small, large, len(row))
    if share is not None:
        radius = np.where(rng.random(len(row)) < share, large, small)
    place = (np.column_stack([column, row]) + rng.random((len(row), 2))) * [asked.length / columns, wide]
    low = place[:, 1] * _PACKED <= _SOLID * (_ROOM * _filled(asked, place[:, 0]) + 2.0 * large)
    return _apart(asked, place[low], radius[low]), radius[low]


def _apart(asked: Deposit, centre: Array, radius: Array) -> Array:
    """Return the centres once disks that overlap, by however much, have been pushed apart without friction."""
    model, state = build_planar_model(_box(asked, centre, radius, 0.0))
    detector, count = PlanarDetector(model), len(radius)
    for _ in range(_PUSHES):
        contacts = detector(state)
        if (-contacts.gap).max(initial=0.0) < _TOUCHING * asked.smallest:
            break
        operator = PlanarDelassus(contacts.bodies, contacts.normal, contacts.lever, model.inertia)
        none, push = np.zeros(len(contacts)), np.zeros((len(contacts), 2))
        operator.gauss_seidel(np.column_stack([contacts.gap, none]), none, none)(push, _PUSH)
        place = state.centre + operator.velocity_change(push)[:, :2]
        # a disk whose centre is beyond a wall would be pushed out of the box
        place[:count, 0] = np.clip(place[:count, 0], radius, asked.length - radius)
        place[:count, 1] = np.maximum(place[:count, 1], radius)
        state = replace(state, centre=place)
    return state.centre[:count]


def _filled(asked: Deposit, x: Array) -> Array:
    """Return the lowest surface that covers the profile and slopes gently, so that disks stay on it [m]."""
    places = np.linspace(0.0, asked.length, _PLACES)
    away = np.abs(places[:, None] - places)
    height: Array = np.interp(x, places, (asked.top(places) - _GENTLE * away).max(axis=1))
    return height


def _fallen(asked: Deposit, centre: Array, radius: Array, progress: Listener) -> Array:
    """Return the centres once disks that start from rest are dense.

    They overlap then: sweeps do not carry the weight of all rows, and are not meant to.
    """
    run = PlanarRun(replace(_box(asked, centre, radius, asked.falling_friction), largest_overlap=np.inf))
    return _calm(run, asked, _CALM, _FALLING, progress)


def _rested(asked: Deposit, centre: Array, radius: Array, progress: Listener) -> Array:
    """Return the centres once disks that start from rest have come to rest again.

    Where they fell with less friction, they come near to rest with it too: they stood apart, and become dense now.
    """
    solver = DiskADMM(_TOLERANCE, np.inf, _ITERATIONS, _PENALTY)
    if asked.falling_friction < asked.friction:
        run = PlanarRun(_box(asked, centre, radius, asked.falling_friction, _FLOWING), solver)
        centre = _calm(run, asked, _DENSER * _SLOW, _RESTING, progress)
    run = PlanarRun(_box(asked, centre, radius, asked.friction), solver)
    return _calm(run, asked, _SLOW, _RESTING, progress)


def _calm(run: PlanarRun, asked: Deposit, slow: float, retained: float, progress: Listener) -> Array:
    """Make steps, damped, until the mean speed over √(g r) is below `slow`; return the centres."""
    count = len(run.model.radius)
    while not run.done:
        last = run.step()
        state = run.simulation.state
        run.simulation.state = replace(state, velocity=retained * state.velocity)
        speed = float(np.hypot(*last.after.velocity[:count, :2].T).mean())
        progress(Progress("deposit", run.steps, None, f"mean speed {speed:.1e} m/s"))
        if run.steps >= _FEWEST and speed < slow * np.sqrt(asked.gravity * asked.smallest):
            break
    return last.after.centre[:count]


def _box(asked: Deposit, centre: Array, radius: Array, friction: float, most: int = _MOST) -> PlanarScene:
    """Put disks into the box."""
    top = float(centre[:, 1].max()) + 2.0 * asked.largest
    step = float(np.sqrt(2.0 * _FALL * asked.smallest / asked.gravity))
    return PlanarScene(
        "deposit",
        tuple(
            Disk(str(number), (float(x), float(y)), float(r), asked.density)
            for number, ((x, y), r) in enumerate(zip(centre, radius, strict=True))
        ),
        (
            Wall("floor", (-asked.length, 0.0), (2.0 * asked.length, 0.0)),
            Wall("left", (0.0, -asked.largest), (0.0, top)),
            Wall("right", (asked.length, -asked.largest), (asked.length, top)),
        ),
        gravity=(0.0, -asked.gravity),
        law=DryJoint(friction=friction),
        rolling=asked.rolling,
        time=PlanarTime(step, 1.0, most * step, stop_at_equilibrium=True),
        solver=SolverSettings(Method.NSGS, max_iterations=_SWEEPS),
    )
