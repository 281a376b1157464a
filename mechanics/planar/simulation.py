"""One step after another in the plane: fly, detect, state the problem, solve, fly on."""

from dataclasses import dataclass, replace

import numpy as np

from ground.errors import SolverError
from mechanics.arrays import Array, Bools, Ints
from mechanics.carried import Carrier
from mechanics.dynamics.progress import Clock
from mechanics.dynamics.warm_start import Memory
from mechanics.planar.contacts import PlanarContacts, PlanarDetector
from mechanics.planar.delassus import PlanarDelassus
from mechanics.planar.model import PlanarModel, PlanarState
from mechanics.planar.overlaps import Apart, Overlaps
from mechanics.planar.stepping import Drive, fly, load_velocity, load_work
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.scene.laws.law import Approach, Terms
from mechanics.solvers.chain import Solver
from mechanics.solvers.choice import choose_planar_solver
from mechanics.solvers.first_order.disk_admm import DiskADMM

# η of the forces at rest with which a run may begin
_AT_REST = 1e-7
# penalty of the ADMM that finds them: that for disks that settle [-]
_PENALTY = 0.05
_LOOKS = 3  # most repetitions of a step that brings together bodies that were not watched


@dataclass(frozen=True)
class PlanarStep:
    """Outcome of one step.

    Attributes
    ----------
    before, after : the states between which it lies
    kick : at the instant of the kick, with the velocities just before it
    contacts : the contact points
    terms : their laws, as shift and cone
    solution : of the contact problem; its impulses are r̃, shifted where a law has adhesion
    impulse : (nc, 2) r on the candidates, local frame [N s]
    internal : (nc, STATE) what the laws remember
    gap : (nc,) at the end of the step, after the correction of overlaps [m]
    loads : (nb, 3) change of the velocities by the loads [m/s, rad/s]
    work : r·u_θ, the work of the contacts [J]
    driven : work that driven bodies put in through the contacts [J]
    lifted : work against the loads by the correction of overlaps; mostly potential energy [J]
    """

    before: PlanarState
    after: PlanarState
    kick: PlanarState
    contacts: PlanarContacts
    terms: Terms
    solution: ContactSolution
    impulse: Array
    internal: Array
    gap: Array
    loads: Array
    work: float
    driven: float
    lifted: float


@dataclass(frozen=True)
class _Stated:
    """The contact problem of a step; `acting` (nc,) are the contacts that are in it."""

    problem: ContactProblem
    acting: Bools
    approach: Approach
    terms: Terms
    law: Ints


@dataclass(frozen=True)
class _Solved:
    """The contacts of a step, what the solver found, and the velocities (nb, 3) after the kick."""

    contacts: PlanarContacts
    operator: PlanarDelassus
    stated: _Stated
    solution: ContactSolution
    impulse: Array
    velocity: Array


class PlanarSimulation(Carrier):
    """A scene of the plane in motion; `step` takes it one time step on.

    Attributes
    ----------
    model : what does not change
    start, state : where it began, and where it is
    """

    CARRIED = ("_first", "_memory", "_overlaps", "state")
    REBUILT = ("_detector", "_drive", "_solver", "clock", "model", "start")

    def __init__(
        self, model: PlanarModel, start: PlanarState, clock: Clock, solver: Solver | None = None
    ) -> None:
        self.model, self.start, self.state, self.clock = model, start, start, clock
        self._drive = Drive(model, start)
        self._detector = PlanarDetector(model)
        self._solver = solver or choose_planar_solver(model.scene.solver, model.scene.min_sweeps)
        self._memory = Memory(2)
        self._overlaps = Overlaps(model.scene.largest_overlap * float(model.radius.min()))
        self._first = True

    def step(self) -> PlanarStep:
        """Fly, detect, state the problem, solve, fly on, and move apart what overlaps too far.

        Raises
        ------
        SolverError : if the motion is no longer finite
        """
        h, theta, model = self.model.scene.time.step, self.model.scene.time.theta, self.model
        if self._first and model.scene.start_iterations:
            self._find_forces()
        with self.clock("advance"):
            kick = self._kick(h, theta)
            loads = load_velocity(model, kick, h)
            free = self._driven(kick, kick.velocity + loads)
        with self.clock("detect"):
            contacts = self._detector(kick)
        if self._first:
            self._overlaps.begin(contacts)
        solved = self._solve(kick, free, contacts, self._memory)
        for _ in range(_LOOKS):
            with self.clock("detect"):
                wider = self._overlooked(kick, solved)
            if wider is None:
                break
            memory = Memory(2)
            memory.store(
                contacts.key, replace(solved.solution, impulse=solved.impulse), solved.stated.approach.state
            )
            contacts = wider
            solved = self._solve(kick, free, contacts, memory)
        with self.clock("advance"):
            after = self._drive.place(fly(replace(kick, velocity=solved.velocity), h * theta))
            if not (np.isfinite(after.velocity).all() and np.isfinite(after.centre).all()):
                raise SolverError(
                    f"the motion is not finite at t = {after.time:.6g} s",
                    where=model.scene.name,
                    remedy="use a smaller time step",
                )
        with self.clock("solve"):
            apart = self._apart(after, solved)
        with self.clock("advance"):
            return self._finish(kick, apart, loads, solved)

    def _find_forces(self) -> None:
        """Find the forces under which the disks rest at the start, nothing driven, from which the first step begins."""
        scene = self.model.scene
        solver = DiskADMM(_AT_REST, np.inf, scene.start_iterations, _PENALTY)
        contacts = self._detector(self.state)
        free = self.state.velocity + load_velocity(self.model, self.state, scene.time.step)
        solved = self._solve(self.state, free, contacts, self._memory, solver)
        solution = replace(solved.solution, impulse=solved.impulse)
        self._memory.store(contacts.key, solution, solved.stated.approach.state)

    def _overlooked(self, kick: PlanarState, solved: _Solved) -> PlanarContacts | None:
        """Detect with a wider watch; return the contacts if the impulses make unwatched bodies overlap, otherwise None.

        A disk that is hit may leave faster than any body came, and reach distant bodies before the next kick.
        """
        scene, radius, h = self.model.scene, self.model.radius, self.model.scene.time.step
        change = (solved.velocity - kick.velocity)[: len(radius), :2]
        ahead = h * np.hypot(change[:, 0], change[:, 1])
        seen = scene.alert_distance * radius.min()
        if not np.isfinite(ahead).all() or 2.0 * ahead.max() <= seen:
            return None
        # two disks that both stay within half of what is watched anyway meet nothing else
        contacts = self._detector(kick, ahead, 2.0 * ahead > seen)
        new = np.flatnonzero(~_among(contacts.key, solved.contacts.key))
        unseen = self._operator(kick, contacts, new).relative_velocity(solved.velocity)[:, 0]
        return self._detector(kick, ahead) if (contacts.gap[new] + h * unseen < 0).any() else None

    def _kick(self, h: float, theta: float) -> PlanarState:
        """Return the state at the instant of the kick, with the velocities just before it."""
        kick = self._drive.place(fly(self.state, h * (1 - theta)))
        if self._first and len(self._drive.bodies):
            # before the first step the walls have moved as they go on to move
            kick = replace(kick, velocity=self._driven(kick, kick.velocity))
        return kick

    def _driven(self, kick: PlanarState, velocity: Array) -> Array:
        """Return `velocity` with that of the driven bodies just after the kick."""
        if not len(self._drive.bodies):
            return velocity
        velocity = velocity.copy()
        velocity[self._drive.bodies] = self._drive.velocity(kick, self.model.scene.time.step)
        return velocity

    def _state_laws(
        self,
        kick: PlanarState,
        contacts: PlanarContacts,
        operator: PlanarDelassus,
        free: Array,
        internal: Array,
    ) -> _Stated:
        """Ask the laws, and state u = W r̃ + (u_free - W s n) for the contacts that act in this step."""
        time = self.model.scene.time
        motion = operator.relative_velocity(kick.velocity)
        approach = Approach(
            gap=contacts.gap,
            speed=motion[:, 0],
            slide=motion[:, 1:],
            area=contacts.area,
            size=contacts.size,
            compliance=operator.diagonal[:, 0, 0],
            step=time.step,
            theta=time.theta,
            push_out=False,
            pair=np.arange(len(contacts.gap)),
            first=np.full(len(contacts.gap), self._first),
            state=internal,
        )
        law = self.model.laws.of(contacts.bodies)
        terms = self.model.laws.terms(law, approach)
        u_free = operator.relative_velocity(free)
        if terms.adhesion.any():
            pull = np.column_stack([terms.adhesion, np.zeros(len(contacts))])
            u_free -= operator.apply(pull)
        acting = np.isfinite(terms.bias)
        # those that do not act are left out of what is solved
        bias = np.where(acting, terms.bias, 0.0)
        problem = ContactProblem(operator, u_free, bias, terms.friction, terms.cohesion)
        return _Stated(problem, acting, approach, terms, law)

    def _operator(
        self, kick: PlanarState, contacts: PlanarContacts, some: Ints | slice = slice(None)
    ) -> PlanarDelassus:
        inertia, threads = self.model.inertia, self.model.scene.solver.threads
        bodies, normal, lever = contacts.bodies[some], contacts.normal[some], contacts.lever[some]
        return PlanarDelassus(bodies, normal, lever, inertia, threads, kick.centre)

    def _solve(
        self,
        kick: PlanarState,
        free: Array,
        contacts: PlanarContacts,
        start: Memory,
        solver: Solver | None = None,
    ) -> _Solved:
        """State the problem of these contacts, and solve it from the impulses in `start`."""
        with self.clock("assemble"):
            operator = self._operator(kick, contacts)
            first, internal = start.recall(contacts.key)
            if start is not self._memory:
                internal = self._memory.recall(contacts.key)[1]
            stated = self._state_laws(kick, contacts, operator, free, internal)
        with self.clock("solve"):
            solution = self._solution(stated, first, solver or self._solver)
        with self.clock("advance"):
            impulse = solution.impulse.copy()
            impulse[:, 0] -= stated.terms.adhesion
            velocity = free + operator.velocity_change(impulse)
        return _Solved(contacts, operator, stated, solution, impulse, velocity)

    def _solution(self, stated: _Stated, start: ContactStart, solver: Solver) -> ContactSolution:
        """Solve for the contacts that act; the others have r̃ = 0."""
        problem, acting = stated.problem, stated.acting
        shifted = start.impulse.copy()
        shifted[:, 0] += stated.terms.adhesion
        if acting.all():
            return solver(problem, start=ContactStart(shifted, start.velocity))
        whole = problem.delassus
        assert isinstance(whole, PlanarDelassus)
        part_of = replace(
            whole, bodies=whole.bodies[acting], normal=whole.normal[acting], lever=whole.lever[acting]
        )
        some = ContactProblem(
            part_of,
            problem.u_free[acting],
            problem.bias[acting],
            problem.friction[acting],
            problem.cohesion[acting],
        )
        solved = solver(some, start=ContactStart(shifted[acting], start.velocity[acting]))
        impulse, velocity = np.zeros_like(shifted), np.zeros_like(shifted)
        impulse[acting], velocity[acting] = solved.impulse, solved.velocity
        return replace(solved, impulse=impulse, velocity=velocity)

    def _apart(self, after: PlanarState, solved: _Solved) -> Apart:
        """Return the end of the step, where disks that overlap too far are moved apart."""
        time, contacts, operator = self.model.scene.time, solved.contacts, solved.operator
        gap = contacts.gap + time.step * time.theta * operator.relative_velocity(after.velocity)[:, 0]
        return self._overlaps(contacts, operator, solved.stated.terms, Apart(after, gap), time.step)

    def _finish(self, kick: PlanarState, apart: Apart, loads: Array, solved: _Solved) -> PlanarStep:
        """Update the laws with the solution, store it for the next step, and account."""
        after = apart.state
        time, model, contacts, stated = self.model.scene.time, self.model, solved.contacts, solved.stated
        operator, solution, impulse = solved.operator, solved.solution, solved.impulse
        u_before = operator.relative_velocity(kick.velocity)
        u = operator.relative_velocity(after.velocity)
        internal = model.laws.after(stated.law, stated.approach, solution.impulse, u)
        self._memory.store(contacts.key, replace(solution, impulse=impulse), internal)
        mean = time.theta * after.velocity + (1 - time.theta) * kick.velocity
        driving = operator.relative_velocity(np.where(model.fixed[:, None], mean, 0.0))
        before, self.state, self._first = self.state, after, False
        return PlanarStep(
            before=before,
            after=after,
            kick=kick,
            contacts=contacts,
            terms=stated.terms,
            solution=solution,
            impulse=impulse,
            internal=internal,
            gap=apart.gap,
            loads=loads,
            work=float(np.sum(impulse * (time.theta * u + (1 - time.theta) * u_before))),
            driven=-float(np.sum(impulse * driving)),
            lifted=0.0 if apart.moved is None else -load_work(model, loads, apart.moved) / time.step,
        )


def _among(key: Ints, stored: Ints) -> Bools:
    """Return the keys (n,) that are among others; both are in order, as contacts are."""
    at = np.minimum(np.searchsorted(stored, key), len(stored) - 1)
    same: Bools = stored[at] == key if len(stored) else np.zeros(len(key), dtype=bool)
    return same
