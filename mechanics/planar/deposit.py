"""Samples of disks: laid out loosely, let fall into a box, cut to a profile, and left to come to rest."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from mechanics.arrays import Array, Bools
from mechanics.dynamics.progress import Listener, Progress, silent
from mechanics.planar.measures.surface import profile
from mechanics.planar.run import PlanarRun
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime, Wall
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import Method, SolverSettings
from moma.errors import SceneError

__all__ = ["Deposit", "deposit"]

_NARROWEST = 4.0  # length and height of a sample over the largest radius, at least [-]
_MOST_DISKS = 2_000_000  # of a sample: more do not fit into the memory of most machines
_LOW = 2.0  # of the surface below the profile over the width of the largest disk, at most [-]
_LOOSE = 1.1  # width of the place of each disk at first, over the largest disk's
_ROOM = 1.25  # height of the box that is filled at first, over what its disks need at rest
_SOLID = 0.82  # share that settled disks fill, at most
_GENTLE = 0.15  # slope of what is filled above the profile, half that at which disks flow [-]
_PLACES = 1001  # places along x at which it is known
_KEPT = (
    0.9  # of the velocities after each step, so that disks fall no farther in one than about their radius [-]
)
_FALL = 0.05  # step in which a disk falls by this share of the smallest radius from rest
_SLOW = 2e-3  # mean speed of the disks over √(g r) at which they have come to rest
_FEWEST, _MOST = 100, 1000  # steps of each of the two stages
_SWEEPS = 100  # of each step


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
    falling_friction : the same while they fall; less makes the sample denser (0.05: 0.845 of the area, 0.4: 0.83)
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

    Disks of random sizes fall into a box; once they rest, those that reach above the profile are taken away, and the
    others come to rest again.

    Raises
    ------
    SceneError : the sample needs more disks than there may be, or what settles does not reach the profile
    """
    centre, radius = _loose(asked)
    centre = _settled(asked, centre, radius, asked.falling_friction, progress)
    _refuse_low(asked, centre, radius)
    keep = _below(asked, centre, radius)
    centre, radius = centre[keep], radius[keep]
    return _settled(asked, centre, radius, asked.friction, progress), radius


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


def _loose(asked: Deposit) -> tuple[Array, Array]:
    """Lay disks out without contact, in rows shifted by half a place, each anywhere in its place."""
    rng = np.random.default_rng(asked.seed)
    wide = 2.0 * _LOOSE * asked.largest
    columns = int((asked.length - 0.5 * wide) / wide)
    small, large, share = asked.smallest, asked.largest, asked.large_share
    if share is None:
        mean = np.pi * (small**2 + small * large + large**2) / 3.0
    else:
        mean = np.pi * ((1.0 - share) * small**2 + share * large**2)
    needed = _ROOM * _SOLID * asked.length * asked.highest / mean
    if needed > _MOST_DISKS:
        raise SceneError(
            f"{needed:.3g} disks of {asked.smallest:g} to {asked.largest:g} m are needed to fill "
            f"{asked.length:g} × {asked.highest:g} m; at most {_MOST_DISKS:,} are taken",
            where="sample",
            remedy="take larger disks, or a smaller sample",
        )
    rows = int(np.ceil(needed / columns))
    row, column = np.indices((rows, columns)).reshape(2, -1)
    radius = rng.uniform(small, large, len(row))
    if share is not None:
        radius = np.where(rng.random(len(row)) < share, large, small)
    free = (0.5 * wide - radius)[:, None]
    pitch = (asked.length - 0.5 * wide) / columns
    place = np.column_stack([pitch * column + 0.5 * wide * (row % 2), wide * row]) + 0.5 * wide
    place += rng.uniform(-1.0, 1.0, place.shape) * free
    low = place[:, 1] <= wide * rows * _filled(asked, place[:, 0]) / asked.highest
    return place[low], radius[low]


def _filled(asked: Deposit, x: Array) -> Array:
    """Return the lowest surface that covers the profile and slopes gently, so that disks stay on it [m]."""
    places = np.linspace(0.0, asked.length, _PLACES)
    away = np.abs(places[:, None] - places)
    height: Array = np.interp(x, places, (asked.top(places) - _GENTLE * away).max(axis=1))
    return height


def _settled(asked: Deposit, centre: Array, radius: Array, friction: float, progress: Listener) -> Array:
    """Return the centres once disks that start from rest have come to rest again."""
    top = float(centre[:, 1].max()) + 2.0 * asked.largest
    step = float(np.sqrt(2.0 * _FALL * asked.smallest / asked.gravity))
    scene = PlanarScene(
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
        time=PlanarTime(step, 1.0, _MOST * step, stop_at_equilibrium=True),
        solver=SolverSettings(Method.NSGS, max_iterations=_SWEEPS),
    )
    run, slow = PlanarRun(scene), _SLOW * np.sqrt(asked.gravity * asked.smallest)
    while not run.done:
        last = run.step()
        state = run.simulation.state
        run.simulation.state = replace(state, velocity=_KEPT * state.velocity)
        speed = float(np.hypot(*last.after.velocity[: len(radius), :2].T).mean())
        progress(Progress("step", run.steps, _MOST, f"mean speed {speed:.1e} m/s"))
        if run.steps >= _FEWEST and speed < slow:
            break
    return last.after.centre[: len(radius)]
