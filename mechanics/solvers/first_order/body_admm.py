"""ADMM between rigid bodies in motion: compiled, with its own factors, and extrapolated where it is slow.

Alternating directions (Boyd et al. 2011; Tasora et al. 2021) with a penalty of each contact's own compliance, and the
de Saxcé shift renewed in each iteration (Acary, Brémond & Huber 2018). As the contacts of moving stones change from
step to step and their forces from iteration to iteration, what counts is the cost of an iteration: of a pass over the
contacts and one solution with the factors of M + H Σ⁻¹ Hᵀ, less than that of a Gauss–Seidel sweep
(mechanics/solvers/_kernels/body_admm.py).
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import chain, cycle

import numpy as np

from ground.errors import SolverError
from mechanics.arrays import Array, Ints
from mechanics.delassus.elimination import elimination
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart, Delassus, RigidContacts
from mechanics.problem.residual import residual
from mechanics.scene.threads import at_once
from mechanics.solvers._kernels import body_admm as kernel
from mechanics.solvers._kernels import body_cholesky as cholesky
from mechanics.solvers._kernels.body_parts import Parts, parts_of
from mechanics.solvers.first_order.body_factors import factorise
from mechanics.solvers.scales import LOOK, MANY, OVERSHOOT, ROUNDING, SPARE

# velocities of a body
_VELOCITIES = 6
# iterates from which is extrapolated, at most
_DEPTH = 6


@dataclass(frozen=True)
class Stage:
    """Some iterations.

    Attributes
    ----------
    penalty : σ of a contact over the mean diagonal of its W_αα; larger values bear with contacts that open and slide,
        smaller ones find the forces of stones that stay in touch sooner. Or three of them, for contacts that are open,
        slide and stick as the stage begins, which cost a factorisation of their own [-]
    iterations : their number
    extrapolated : from the iterates before (Anderson 1965)
    further : tolerances over those asked for, of a stage that goes on at little cost: the next steps begin where the
        last ones lead, and gain from what these go further [-]
    """

    penalty: float | tuple[float, float, float]
    iterations: int = 50
    extrapolated: bool = True
    further: float = 1.0


# penalty of contacts that slide [-]
_SLIDING = 0.05
# penalty of those that stick: their forces, which grow steadily until one slips, arrive 200 times as soon as with that
# of open contacts [-]
_STICKING = 0.005
# in turn, contacts sort themselves into open, sliding and sticking, and their forces arrive
_TURNS = (Stage(1.0, extrapolated=False), Stage((1.0, _SLIDING, _STICKING), extrapolated=False))
SORTED = (Stage(1.0, LOOK, extrapolated=False), _TURNS[1])
"""The first turn: few iterations tell most contacts apart."""

# penalty of those that stick in stones at rest: joints hold as a rule, and their forces arrive at once [-]
_HOLDING = 1e-3
RESTING = Stage((1.0, _SLIDING, _HOLDING))
"""The forces of a rest, once contacts are sorted."""

# penalty of all contacts that carries forces across stones whose masses differ by 10⁶ [-], and its iterations
_CARRIES, _LONG = 0.02, 150
STEADY = (Stage(_CARRIES, _LONG, extrapolated=False), Stage(_SLIDING, _LONG), *SORTED)
"""Stages that need no other method before or after them."""


@dataclass(frozen=True)
class BodyADMM:
    """ADMM on the velocities of rigid bodies until η and the velocity error are within their tolerances.

    Joints between them may be rigid or compliant. Threads share the iterations of many bodies, with the same bits.

    Attributes
    ----------
    tolerance, velocity_tolerance, max_iterations : as in `NSGS`, iterations for sweeps
    stages : first, one after the other, as long as it is not solved; contacts that sort themselves follow in turns with
        forces that arrive, again and again
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 1000
    stages: tuple[Stage, ...] = SORTED

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`; return the best of all looks.

        Raises
        ------
        SolverError : if W is not that of rigid bodies, or no contact holds a body
        """
        contacts = problem.delassus.rigid
        if contacts is None:
            raise SolverError(
                "bodies are not all rigid", where="ADMM of bodies", remedy='use the method "auto"'
            )
        if len(start.impulse) == 0:
            return ContactSolution(start.impulse, start.velocity, 0, 0.0, True)
        run = _Run(problem, contacts, start, self)
        run.look()
        while run.excess > run.goal and run.iterations < self.max_iterations:
            run.iterate()
            run.look()
        impulse, velocity = run.best()
        remaining = residual(problem, impulse)
        within = remaining.within(self.tolerance, self.velocity_tolerance)
        return ContactSolution(impulse, velocity, run.iterations, remaining.natural_map, within)


class _Run:
    """Iterates of one solution.

    Attributes
    ----------
    iterations : so far
    excess : the larger of both errors of the best look over their tolerances [-]
    """

    def __init__(
        self, problem: ContactProblem, contacts: RigidContacts, start: ContactStart, settings: BodyADMM
    ) -> None:
        self._problem, self._settings, self._bodies = (
            problem,
            settings,
            _bodies_of(problem.delassus, contacts),
        )
        bodies, first = self._bodies, settings.stages[0]
        self._compliance = bodies.compliance(problem.delassus.joint_compliance)
        self._soft = bodies.soft(np.max(first.penalty), self._compliance)
        free = kernel.to_world(bodies.geometry, problem.u_free)
        self._free = bodies.spread(free)
        rows = [free + problem.bias[:, None] * bodies.geometry[:, :3], problem.friction, problem.cohesion]
        field = bodies.field(rows, problem.adhesion, self._compliance)
        self._touching = kernel.Touching(bodies.runs, field)
        self._soften(self._soft)
        self._pace = float(np.abs(problem.u_free).max()) or float(np.abs(problem.bias).max()) or 1.0
        x = kernel.projected(start.impulse, problem.friction, problem.cohesion)
        x -= start.velocity * bodies.collected(self._soft)[:, None]
        x = bodies.spread(kernel.to_world(bodies.geometry, x))
        self._iterate = kernel.Iterate(x, np.zeros_like(x), np.zeros(6 * len(bodies.inertia)), bodies.load())
        self._z = np.empty_like(x)
        self._stages: Iterator[Stage] = chain(settings.stages, cycle(_TURNS))
        self._factors: kernel.Factors | None = None
        self._memory = _acceleration(0, 0)
        self._until, self._further = 0, first.further
        self.iterations, self.excess, self._change, self._limit = 0, np.inf, np.inf, 0.0

    @property
    def goal(self) -> float:
        """Errors over their tolerances at which the iteration ends [-]."""
        return 1.0 if 0 < self.iterations == self._until else self._further

    def iterate(self) -> None:
        """Make iterations until the next look."""
        if self.iterations == self._until:
            self._begin(next(self._stages))
        first, most = self.iterations == 0, min(self._settings.max_iterations, self._until) - self.iterations
        least = min(LOOK, most)
        self._advance(least, 0.0)
        if not first and self._change > self._limit:
            # changes of velocities foretell the residual for a part of the iterations so far alone
            later = max(self.iterations // LOOK, LOOK)
            self._advance(min(most - least, later), self._limit)

    def _advance(self, count: int, limit: float) -> None:
        if len(self._bodies.groups) > 1 and not self._memory.image.size:
            self._advance_at_once(count, limit)
            return
        made, self._change = kernel.advance(
            self._iterate,
            count,
            limit,
            OVERSHOOT,
            self._bodies.length,
            self._touching,
            self._factors,
            self._memory,
        )
        self.iterations += made

    def _advance_at_once(self, count: int, limit: float) -> None:
        """Make the same iterations with all groups of parts at once; the same bits."""
        iterate, length, touching, factors = self._iterate, self._bodies.length, self._touching, self._factors
        assert factors is not None
        groups = self._bodies.groups
        share = at_once(len(groups))

        def each(stage: Callable[..., float | None], *arguments: object) -> list[float | None]:
            """Make a stage for all groups of bodies, by threads."""
            return share(lambda group: stage(group, iterate, *arguments), groups)

        step = np.empty(len(iterate.load), factors.value.dtype)
        each(kernel.begin, touching, factors)
        for _ in range(count):
            each(kernel.down, step, factors)
            change = kernel.between(iterate, step, length, factors)
            self._change = max(change, *each(kernel.up, step, (OVERSHOOT, length), touching, factors))
            self.iterations += 1
            if not self._change > limit:
                return

    def _begin(self, stage: Stage) -> None:
        """Go on with the penalty of a stage; y keeps its velocities."""
        self._until, self._further = self._until + stage.iterations, stage.further
        self._memory = _acceleration(_DEPTH if stage.extrapolated else 0, self._iterate.x.size)
        self._broken()
        x, z = _vectors(self._iterate.x), _vectors(self._z)
        common = stage.penalty if isinstance(stage.penalty, float) else None
        penalty = common or np.array(stage.penalty)[_kinds(x, z).ravel()]
        soft = self._bodies.soft(penalty, self._compliance)
        if not np.array_equal(soft, self._soft):
            ratio = np.ones_like(soft)
            np.divide(soft, self._soft, out=ratio, where=self._soft > 0)
            x[:] = z + (x - z) * ratio.reshape(len(x), 1, -1)
            self._soften(soft)
        # those of the stage before make room for them
        self._factors = None
        self._factors = self._bodies.factors(common if self._compliance is None else None, self._touching)

    def _soften(self, soft: Array) -> None:
        """Give the contacts their 1/σ."""
        self._soft = soft
        rows = self._touching.field.reshape(-1, kernel.ROWS, kernel.BLOCK)
        rows[:, kernel.SOFT] = soft.reshape(-1, kernel.BLOCK)
        if self._compliance is not None:
            rows[:, kernel.SHARE : kernel.SHARE + 2] = 1.0 / (1.0 + rows[:, [kernel.SOFT]] * self._compliance)

    def _broken(self) -> tuple[float, float, float]:
        iterate, scale = self._iterate, self._problem.delassus.scale
        broken_laws: tuple[float, float, float] = kernel.broken_laws(
            iterate.x, self._touching, self._free, self._bodies.inertia, 1.0 / scale, self._z
        )
        return broken_laws

    def look(self) -> None:
        """Measure the iterate, and remember it if it is the best so far."""
        settings, scale = self._settings, self._problem.delassus.scale
        whole, largest, size = self._broken()
        eta = whole / max(size, 1e-300)
        excess = max(eta / settings.tolerance, largest * scale / self._pace / settings.velocity_tolerance)
        if np.isfinite(self._change) and excess > 0:
            self._limit = self._change * self.goal / excess
        if self.iterations == 0 or excess < self.excess:
            snapshot = self._iterate.x.copy(), self._z.copy(), self._soft
            self.excess, self._best = float(excess), snapshot

    def best(self) -> tuple[Array, Array]:
        """Return the impulses and the velocities û (nc, 3) of the best look, local frames."""
        x, z, soft = self._best
        geometry, collected = self._bodies.geometry, self._bodies.collected
        impulse, beyond = collected(z), collected(z - x)
        velocity = beyond / collected(soft)[:, None]
        return kernel.to_local(geometry, impulse), kernel.to_local(geometry, velocity)


class _Bodies:
    """Parts of a problem that depend on W alone: the order of elimination, and factors by their penalty.

    As long as no stone has moved so far that its contacts are detected again, all steps share it.

    Attributes
    ----------
    geometry : (nc, 15) as in `RigidContacts`
    runs : as in `Touching`
    inertia : (nm, 7) of the moving bodies, in the order of elimination
    length : mean distance of contacts from the centres of mass [m]
    groups : parts that each thread takes
    """

    def __init__(self, delassus: Delassus, contacts: RigidContacts) -> None:
        moving = np.flatnonzero(contacts.inertia[:, 0] > 0)
        order, side, self._panels = _eliminated(contacts, moving)
        self._parts = parts_of(self._panels, len(moving) >= MANY)
        self._place, self.runs = _runs(side, contacts.geometry, self._parts, len(moving))
        self._blocks = len(self.runs.block) - 1
        self.geometry = np.ascontiguousarray(contacts.geometry)
        self.inertia = contacts.inertia[order]
        self._mass: Array = kernel.masses(contacts.inertia, order)
        self._compliance = np.full(kernel.BLOCK * self._blocks, np.inf)
        self._compliance[self._place] = np.einsum("cii->c", delassus.diagonal) / 3.0
        self.length = float(np.sqrt((self.geometry[:, 9:12] ** 2) @ np.ones(3)).mean())
        self._fixed = [self.spread(self.geometry[:, a : a + 3]) for a in (0, 9)]
        self._factors: dict[float | None, kernel.Factors] = {}
        threads = min(getattr(delassus, "threads", 1), len(self._parts.body))
        self.groups = _groups(self._panels, self._parts, self.runs, threads)

    def spread(self, values: Array) -> Array:
        """Return numbers (nc,) or vectors (nc, 3) of contacts in their places, block by block, else 0."""
        places = np.zeros((kernel.BLOCK * self._blocks, *values.shape[1:]))
        places[self._place] = values
        if values.ndim == 1:
            return places
        return np.ascontiguousarray(places.reshape(-1, kernel.BLOCK, 3).transpose(0, 2, 1)).ravel()

    def collected(self, values: Array) -> Array:
        """Return numbers or vectors of contacts from their places: the reverse of `spread`."""
        if len(values) == kernel.BLOCK * self._blocks:
            return values[self._place]
        vectors: Array = _vectors(values).transpose(0, 2, 1).reshape(-1, 3)[self._place]
        return vectors

    def compliance(self, diagonal: Array | None) -> Array | None:
        """Return E (n, 2, BLOCK) across and along joints of a diagonal (nc, 3); None where joints are rigid."""
        if diagonal is None:
            return None
        both = [self.spread(np.ascontiguousarray(diagonal[:, k])).reshape(-1, kernel.BLOCK) for k in (0, 1)]
        return np.stack(both, axis=1)

    def field(self, laws: list[Array], adhesion: Array | None, compliance: Array | None) -> Array:
        """Return the field of `Touching` without 1/σ; `laws` are shift (nc, 3), friction and cohesion (nc,)."""
        rows = np.zeros((self._blocks, kernel.ROWS, kernel.BLOCK))
        shift, friction, cohesion = map(self.spread, laws)
        for at, vectors in zip((0, kernel.ARM, kernel.SHIFT), (*self._fixed, shift), strict=True):
            rows[:, at : at + 3] = _vectors(vectors)
        rows[:, kernel.SHARE : kernel.SHARE + 2] = 1.0
        if compliance is not None:
            rows[:, kernel.YIELD : kernel.YIELD + 2] = compliance
        numbers = {kernel.FRICTION: friction, kernel.COHESION: cohesion}
        if adhesion is not None:
            numbers[kernel.ADHESION] = self.spread(adhesion)
        for at, values in numbers.items():
            rows[:, at] = values.reshape(-1, kernel.BLOCK)
        return rows.ravel()

    def load(self) -> Array:
        """Return room for what acts on the bodies, and on the copies of those between parts."""
        copies = (len(self._parts.body) + 1) * len(self._parts.shared)
        return np.empty(_VELOCITIES * (len(self.inertia) + copies))

    def soft(self, penalty: float | Array, compliance: Array | None) -> Array:
        """Return 1/σ of each place for a penalty, or one of each, over the mean diagonals of W_αα; else 0 [kg].

        Where joints yield by E, `compliance`, σ is larger by E: of small contacts that is 10⁴ times W_αα.
        """
        sigma = penalty * self._compliance
        if compliance is not None:
            sigma += compliance[:, 0].ravel()
        soft: Array = 1.0 / sigma
        return soft

    def factors(self, penalty: float | None, touching: kernel.Touching) -> kernel.Factors:
        """Return the factors of M + H Σ⁻¹ Hᵀ for the σ of `touching`, kept where these follow from one penalty.

        Raises
        ------
        SolverError : if W is not a number
        """
        if penalty in self._factors:
            return self._factors[penalty]
        many = len(self.inertia) >= MANY
        if many and penalty is not None:
            # room for one
            self._factors.clear()
        value = np.zeros(self._panels.start[-1], dtype=np.float32 if many else np.float64)
        kernel.assemble(touching, self._mass, self._panels, value)
        if not factorise(self._panels, value, self._parts, len(self.groups)):
            raise SolverError("W is not a number", where="ADMM of bodies", remedy="use another method")
        factors = kernel.Factors(self._panels, self._parts, value, self._mass)
        if penalty is not None:
            self._factors[penalty] = factors
        return factors


def _bodies_of(delassus: Delassus, contacts: RigidContacts) -> _Bodies:
    """Return the bodies of an operator, which remembers them if it can; joints that yield have those of rigid ones."""
    delassus = getattr(delassus, "inner", delassus)
    memo: dict[str, _Bodies] = getattr(delassus, "memo", {})
    if "bodies" not in memo:
        memo["bodies"] = _Bodies(delassus, contacts)
    return memo["bodies"]


def _runs(side: Ints, geometry: Array, parts: Parts, count: int) -> tuple[Ints, kernel.Runs]:
    """Return the place of each contact, and the runs.

    Parameters
    ----------
    side : (nc, 2) places of their bodies in the order of elimination, -1: does not move
    geometry : as in `RigidContacts`
    parts : of the `count` bodies that move
    """
    offset = geometry[:, 9:12] - geometry[:, 12:]
    new = np.ones(len(side), dtype=bool)
    new[1:] = (side[1:] != side[:-1]).any(axis=1)
    new[1:] |= (np.abs(offset[1:] - offset[:-1]) > ROUNDING * np.abs(offset[1:]).max(axis=1)[:, None]).any(
        axis=1
    )
    number = np.arange(len(side))
    new |= (number - np.maximum.accumulate(np.where(new, number, 0))) % kernel.BLOCK == 0
    first = np.flatnonzero(new)
    body, many, shared = side[first], len(parts.body), len(parts.shared)
    # bodies that do not move belong to no part; -1 takes the last place
    part_of, rank = np.full(count + 1, many), np.zeros(count + 1, dtype=np.int64)
    for index, (begin, end) in enumerate(parts.body):
        part_of[begin:end] = index
    part_of[parts.shared] = many
    rank[parts.shared] = np.arange(shared)
    index = part_of[body].min(axis=1)
    place = np.where(part_of[body] < many, body, count + index[:, None] * shared + rank[body])
    order = np.argsort(index, kind="stable")
    sizes = np.diff(first, append=len(side))
    begin, block, of_part = kernel.packed(sizes[order], index[order], many + 1)
    runs = kernel.Runs(
        begin, begin + sizes[order], body[order], place[order], offset[first[order]], block, of_part
    )
    where = np.empty(len(first), dtype=np.int64)
    where[order] = begin
    return np.repeat(where - first, sizes) + number, runs


def _vectors(values: Array) -> Array:
    """Return vectors of contacts as (n, 3, BLOCK)."""
    return values.reshape(-1, 3, kernel.BLOCK)


def _groups(panels: cholesky.Panels, parts: Parts, runs: kernel.Runs, threads: int) -> list[Ints]:
    """Return the parts that each thread takes, so that all have about the same to do."""
    numbers = np.append(np.diff(panels.start[parts.panel], axis=1)[:, 0], 0)
    # a block of contacts costs as much as the numbers that it reads and writes
    work = numbers + kernel.ROWS * kernel.BLOCK * np.diff(runs.block[runs.part])
    shares: list[list[int]] = [[] for _ in range(threads)]
    for piece in np.argsort(-work, kind="stable"):
        min(shares, key=lambda assigned: work[assigned].sum()).append(int(piece))
    return [np.array(share, dtype=np.int64) for share in shares]


def _kinds(x: Array, z: Array) -> Ints:
    """Return whether contacts are open (0), slide (1) or stick (2), from x and z = P_K(x) (n, 3, BLOCK)."""
    force, beyond = np.abs(z).max(axis=1), np.abs(x - z).max(axis=1)
    kinds: Ints = np.where(force == 0.0, 0, np.where(beyond > ROUNDING * force, 1, 2))
    return kinds


def _acceleration(depth: int, size: int) -> kernel.Acceleration:
    return kernel.Acceleration(
        np.empty((depth, size)),
        np.empty((depth, size)),
        np.zeros((depth, depth)),
        np.zeros(2, dtype=np.int64),
        np.zeros(1),
    )


def _eliminated(contacts: RigidContacts, moving: Ints) -> tuple[Ints, Ints, cholesky.Panels]:
    """Return the moving bodies in the order of their elimination, the contacts' places in it, and the panels."""
    place = np.full(len(contacts.inertia), -1)
    place[moving] = np.arange(len(moving))
    side = place[contacts.body]
    # contacts of the same two bodies follow each other
    new = np.ones(len(side), dtype=bool)
    new[1:] = (side[1:, 0] != side[:-1, 0]) | (side[1:, 1] != side[:-1, 1])
    inner = side[new]
    inner = inner[(inner[:, 0] >= 0) & (inner[:, 1] >= 0)]
    pairs = np.unique(np.minimum(*inner.T) * len(moving) + np.maximum(*inner.T))
    if len(moving) < MANY:
        rank, panels = _pattern_of_few(pairs.tobytes(), len(moving))
    else:
        rank, panels = _pattern(pairs, moving, contacts.centre)
    order = np.empty_like(moving)
    order[rank] = moving
    return order, np.where(side >= 0, rank[side], -1), panels


def _pattern(pairs: Ints, moving: Ints, centre: Array) -> tuple[Ints, cholesky.Panels]:
    """Return the rank of each moving body and the panels, from pairs i n + j (m,) of the n bodies, in order."""
    count = len(moving)
    both = np.column_stack([pairs // count, pairs % count])
    rank = elimination(both, moving, centre)
    rank = cholesky.postorder(np.ascontiguousarray(rank[both]), count)[rank]
    return rank, cholesky.panels_of(np.ascontiguousarray(rank[both]), count, SPARE, _VELOCITIES)


@lru_cache(maxsize=1)
def _pattern_of_few(pairs: bytes, count: int) -> tuple[Ints, cholesky.Panels]:
    """Return the same by least degree, which no place of a body changes: nearly all steps of a motion share it."""
    return _pattern(np.frombuffer(pairs, dtype=np.int64), np.arange(count), np.zeros((0, 3)))
