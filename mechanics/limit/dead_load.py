"""Dead load: the loads of a scene at one instant, and whether its stones stand under them."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from mechanics.arrays import Array
from mechanics.dynamics.outcome import Outcome
from mechanics.dynamics.progress import Listener, silent
from mechanics.dynamics.stopping import MOVED
from mechanics.limit.assembly import RigidAssembly, assembly
from mechanics.limit.programme import Ending, Programme
from mechanics.scene.loads.load import Force, Loads
from mechanics.scene.scene import Scene, Start
from mechanics.simulate import simulate
from moma.errors import SceneError

__all__ = ["Standing", "admits_rest", "at_instant", "stands"]


@dataclass(frozen=True)
class _Held:
    """Force that stays what another one is at an instant [s]."""

    force: Force
    instant: float
    until = 0.0

    @property
    def stones(self) -> frozenset[str]:
        """Codes."""
        return self.force.stones

    def __call__(self, time: float, centre: Array, rotation: Array) -> tuple[Array, Array]:
        """Return the force (n, 3) [N] and its moment (n, 3) [N m]."""
        return self.force(self.instant, centre, rotation)


def at_instant(scene: Scene, time: float | None = None) -> Scene:
    """Return a scene whose loads are for good those of an instant [s]; None: the one from which they are constant.

    Raises
    ------
    SceneError : its loads never become constant, and no instant is given; or a support has moved by then
    """
    loads = scene.loads
    when = loads.until if time is None else time
    if not np.isfinite(when):
        raise SceneError(
            "its loads never become constant",
            where=scene.name,
            remedy="name the instant at which they are taken",
        )
    for motion in loads.motions:
        pose = motion.pose(when)
        if np.any(pose.displacement) or not np.array_equal(pose.rotation, np.eye(3)):
            raise SceneError(
                f"the supports {', '.join(sorted(motion.stones)[:4])} have moved at t = {when:g} s, "
                "and limit loads are those of stones in their places",
                where=scene.name,
                remedy="leave that motion out, or run the scene to see what it does",
            )
    gravity = np.array(scene.gravity, dtype=float)
    for change in loads.gravity:
        gravity = change(when, gravity)
    forces = tuple(_Held(force, when) for force in loads.forces)
    x, y, z = gravity.tolist()
    return replace(scene, gravity=(x, y, z), loads=Loads(forces=forces))


@dataclass(frozen=True)
class Standing:
    """Stones under their dead load alone.

    Attributes
    ----------
    outcome : of the run
    reason : its reason, in words
    moved : codes of the stones that do not stand as surveyed, the farthest first
    displacement : (nb, 3) of the centres of all stones' corners [m]
    """

    outcome: Outcome
    reason: str
    moved: tuple[str, ...]
    displacement: Array


def admits_rest(scene: Scene) -> bool:
    """Return whether some forces within the strength of rigid joints balance the dead load, whatever brings them about.

    Raises
    ------
    SceneError, SolverError : see `assembly` and `Programme`
    """
    on = assembly(at_instant(scene))
    least = np.zeros((len(on.contacts), 3))
    least[:, 0] = 1.0 / len(least)
    return Programme(on, None, scene.name).solve(on.strength, cost=least).ending is Ending.FOUND


def stands(
    on: RigidAssembly, progress: Listener = silent, stop: Callable[[], bool] = lambda: False
) -> Standing:
    """Return whether stones stand under their dead load, as a run of their scene from rest says it, all rigid."""
    scene = on.model.scene
    time = replace(scene.time, start=Start.REST, stop_at_equilibrium=True)
    result = simulate(replace(scene, time=time), progress, stop)
    displacement = np.array([body.displacement.mean(axis=0) for body in result.bodies])
    farthest = np.array([np.linalg.norm(body.displacement, axis=1).max() for body in result.bodies])
    share = np.where(on.model.fixed, 0.0, farthest / on.model.surfaces.size)
    order = np.argsort(-share, kind="stable")
    moved = tuple(scene.blocks[body].code for body in order if share[body] > MOVED)
    return Standing(result.outcome, result.reason, moved, displacement)
