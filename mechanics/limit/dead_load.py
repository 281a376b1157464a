"""Dead load: the loads of a scene at one instant, whether its stones stand under them, and in which state.

Where the dead load moves stones by more than the gaps that count as closed, or breaks bonds, limit loads are those of
the state at rest: the stones lie where they rest, joints that opened are open, and broken bonds hold nothing.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ground.errors import SceneError
from mechanics.arrays import Array
from mechanics.dynamics.outcome import Outcome
from mechanics.dynamics.progress import Listener, silent
from mechanics.dynamics.simulation import CLOSED_BIAS, Simulation
from mechanics.dynamics.verdicts.watch import MOVED
from mechanics.limit.assembly import CLOSED, RigidAssembly, assembly
from mechanics.limit.programme import Ending, Programme
from mechanics.results.result import Result
from mechanics.scene.loads.load import Force, Loads
from mechanics.scene.scene import Block, LawRule, Part, Scene, Start
from mechanics.simulate import simulate

# gap over the width up to which a joint is closed where stones rest: a run leaves 1e-8, and a block falls by more [-]
_SHUT = 1e-5
# status of contacts whose bond has not broken, and of those that bear nothing
_HOLDS, _PARTED = ("bonded", "crush"), ("open", "broken")


@dataclass(frozen=True)
class _Held:
    """Force that stays what another one is at an instant [s]."""

    force: Force
    instant: float
    until = 0.0
    course = None

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
    rest : stones and joints at rest; None where they do not rest, or rest as they are drawn with all bonds
    broken : pairs of stones, by their codes, whose bonds the dead load has broken
    falls_as_drawn : no forces balance the dead load in the joints as they are drawn, though the stones rest elsewhere
    farthest : largest displacement of a corner [m]
    """

    outcome: Outcome
    reason: str
    moved: tuple[str, ...]
    displacement: Array
    rest: RigidAssembly | None = None
    broken: tuple[tuple[str, str], ...] = ()
    falls_as_drawn: bool = False
    farthest: float = 0.0


def self_stress_alone_holds(scene: Scene) -> bool:
    """Return whether forces between rigid joints could hold stones as they are drawn, but no load brings them about.

    Forces from nothing are tried, and must surely move the stones. False where joints have springs, or are drawn open
    by more than a step of the scene closes: then the motion needs no self-stress to be explained.

    Raises
    ------
    SceneError, SolverError : see `assembly` and `Programme`
    """
    on = assembly(at_instant(scene))
    closed = CLOSED_BIAS * float(np.linalg.norm(on.model.gravity(0.0))) * scene.time.step**2
    if on.model.laws.sprung or on.widest > closed:
        return False
    moves = Simulation(on.model, on.state).rests_from_nothing() is False
    return moves and _balances(on)


def _balances(on: RigidAssembly) -> bool:
    """Return whether some forces within the strength of the joints balance the dead load."""
    least = np.zeros((len(on.contacts), 3))
    least[:, 0] = 1.0 / len(least)
    optimum = Programme(on, None, on.model.scene.name).solve(on.strength, cost=least)
    return optimum.ending is Ending.FOUND


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
    standing = Standing(
        result.outcome, result.reason, moved, displacement, farthest=float(farthest.max(initial=0.0))
    )
    if not result.outcome.rests:
        return standing
    broken = _broken(on, result)
    # springs settle under the weight anew in each run, so that their joints stay where they are drawn
    leaves = bool(share.max(initial=0.0) > CLOSED) and not on.model.laws.sprung
    if not broken and not leaves:
        return standing
    drawn = set(map(tuple, np.sort(on.contacts.bodies, axis=1).tolist()))
    codes = tuple((scene.blocks[a].code, scene.blocks[b].code) for a, b in broken if (a, b) in drawn)
    falls = leaves and not _balances(on)
    return replace(standing, rest=_at_rest(on, result, broken, leaves), broken=codes, falls_as_drawn=falls)


def _at_rest(
    on: RigidAssembly, result: Result, broken: dict[tuple[int, int], bool], leaves: bool
) -> RigidAssembly:
    """Return stones and joints at the end of a run, without the bonds of pairs that are `broken`.

    Where the run `leaves` the drawing, or has parted a joint, joints are closed only up to what a run leaves of them,
    if forces balance the dead load in these.
    """
    scene, laws = on.model.scene, on.model.laws
    rules = list[LawRule]()
    for (a, b), parted in broken.items():
        law = laws.laws[int(laws.of(np.array([[a, b]]))[0])]
        first, second = (frozenset([scene.blocks[body].code]) for body in (a, b))
        rules.append(LawRule(first, second, law.without_bond(parted)))
    moves = (leaves or any(broken.values())) and not laws.sprung
    blocks = (
        _moved(block, body.reference, body.position)
        for block, body in zip(scene.blocks, result.bodies, strict=True)
    )
    rested = replace(
        scene,
        blocks=tuple(blocks) if moves else scene.blocks,
        contact=replace(scene.contact, rules=(*scene.contact.rules, *rules)),
    )
    if moves:
        try:
            tight = assembly(rested, _SHUT)
        except SceneError:
            tight = None
        if tight is not None and _balances(tight):
            return tight
    return assembly(rested)


def _moved(block: Block, before: Array, after: Array) -> Block:
    """Return a rigid block that has moved as its corners (n, 3) have, without rounding of its shape."""
    if np.array_equal(before, after):
        return block
    middle, now = before.mean(axis=0), after.mean(axis=0)
    u, _, vt = np.linalg.svd((after - now).T @ (before - middle))
    turn = u @ np.diag([1.0, 1.0, float(np.sign(np.linalg.det(u @ vt)))]) @ vt
    parts = tuple(Part((piece.vertices - middle) @ turn.T + now, piece.faces) for piece in block.parts)
    return replace(block, vertices=(block.vertices - middle) @ turn.T + now, parts=parts)


def _broken(on: RigidAssembly, result: Result) -> dict[tuple[int, int], bool]:
    """Return the pairs of bodies that mortar was to hold and does not at some point, and whether they have parted.

    On the safe side: a joint that has cracked at one point holds no tension and no cohesion at the others.
    """
    laws, contacts = on.model.laws, result.contacts
    meant = laws.makes_bonds(laws.of(contacts.bodies)) & (contacts.area > 0)
    pairs = np.sort(contacts.bodies[meant], axis=1).tolist()
    status = contacts.status[meant].tolist()
    lost = {(a, b) for (a, b), state in zip(pairs, status, strict=True) if state not in _HOLDS}
    touching = {(a, b) for (a, b), state in zip(pairs, status, strict=True) if state not in _PARTED}
    return {pair: pair not in touching for pair in sorted(lost)}
