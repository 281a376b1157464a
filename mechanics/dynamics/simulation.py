"""The time loop of docs/theory.md: predict, detect, state the contact problem, solve, advance."""

from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from ground.errors import SolverError
from mechanics.arrays import Array, Bools
from mechanics.carried import Carried, Carrier
from mechanics.dynamics.contact_problem import (
    SOFTNESS,
    JointCompliance,
    contact_problem,
    may_yield,
    shifted,
    unshifted,
)
from mechanics.dynamics.contact_search import ContactSearch, Detection
from mechanics.dynamics.handover import Beginning, Handover, of_run
from mechanics.dynamics.observers.energy import kinetic_energy
from mechanics.dynamics.progress import Clock
from mechanics.dynamics.rest.relaxation import Relaxation, halted
from mechanics.dynamics.rest.sleeping import Sleepers
from mechanics.dynamics.step import Step
from mechanics.dynamics.stepping import Kick, advance, compliances, free_kick, kicked, predict
from mechanics.dynamics.warm_start import Memory
from mechanics.model.model import Model
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.scene.laws.law import Approach
from mechanics.scene.scene import Method, SolverSettings
from mechanics.scene.state import State
from mechanics.solvers.chain import Solver
from mechanics.solvers.choice import choose_solver
from mechanics.solvers.from_nothing import rests_from_nothing

CLOSED_BIAS = 1e-3
"""Bias of a gap over the largest u_free up to which it is one of an inexact step, and counts as closed [-]."""

# velocity tolerance over that of the balance: contacts that break their laws by more leave stones unbalanced [-]
_BALANCED = 0.1
_CRUSHING = 10  # most solutions of a step in search of the joints that crush
# predicted state, contacts, free motion, internal variables, and how the run begins
_Given = tuple[State, Detection, Kick, Array, Beginning | None]
_Solved = tuple[ContactProblem, Approach, ContactSolution]


class Simulation(Carrier):
    """A scene in motion; `step` advances it by one time step.

    Parameters
    ----------
    model, start : as `build_model` makes them, or the beginning of a stage of building
    clock : takes the time of each stage
    solver : of the contact problems; None: that of the scene
    elastic_scale : measure how well they are solved against the elastic part of W alone (`mixed_delassus`)
    fresh_contacts : detect contacts in every step, even where nothing has moved since the last detection

    Attributes
    ----------
    state : at the end of the last step
    """

    CARRIED = ("_first", "_freed", "_joints", "_memory", "_relax", "_sleepers", "state")
    REBUILT = (
        "_begin", "_compliance", "_detect", "_given", "_may_yield", "_solve", "_step", "_theta", "clock", "model",
        "start",
    )  # fmt: skip

    def __init__(
        self,
        model: Model,
        start: State | Beginning,
        clock: Clock | None = None,
        solver: Solver | None = None,
        elastic_scale: bool = False,
        fresh_contacts: bool = False,
    ) -> None:
        self._begin = begin = of_run(start) if isinstance(start, State) else start
        self.model, self.start, self.state, self.clock = model, begin.state, begin.state, clock or Clock()
        self._step, self._theta = model.scene.time.step, model.scene.time.theta
        with self.clock("assemble"):
            self._compliance = compliances(model, self._step, self._theta)
        bed = begin.bed(model)
        self._detect = ContactSearch(
            model, begin.state, self._compliance, self.clock, fresh_contacts, elastic_scale, bed
        )
        self._given = solver
        self._solve = solver or _solver_of(model, model.scene.solver)
        self._may_yield = solver is None and may_yield(model)
        self._joints = JointCompliance(lasting=model.mostly_rigid)
        self._relax = Relaxation(model)
        self._memory = begin.memory or Memory(follows=not model.scene.time.relaxation)
        self._sleepers = Sleepers(model, self.start, self._memory)
        self._first = True
        self._freed = False

    @property
    def asleep(self) -> Bools:
        """Sleeping bodies (nb,)."""
        return self._sleepers.asleep

    def halt(self, time: float) -> None:
        """Bring all bodies to a halt, and set the clock of the scene to `time` [s]."""
        self.state = replace(halted(self.state), time=time)

    def take_over(self, earlier: "Simulation") -> None:
        """Continue where another run of the same bodies came to rest, with its forces and internal variables.

        The bodies have the velocities with which this run begins.
        """
        state = self.state
        self.state = replace(
            earlier.state, time=state.time, velocity=state.velocity, node_velocity=state.node_velocity
        )
        pace = self._step / earlier._step
        self._memory = earlier._memory.at_rest(pace)
        self._memory.follows = not self.model.scene.time.relaxation
        # stiffness 1/(ε h²) stays
        self._joints = replace(earlier._joints, value=earlier._joints.value / pace**2)
        if pace == 1.0 and self.model.rigid_only:
            self._detect.follow(earlier._detect, self.model)
        else:
            self._detect.recess = earlier._detect.recess
        self._sleepers = Sleepers(self.model, self.state, self._memory)
        self._first = False

    def handed_over(self) -> Handover:
        """Return what the next stage of building takes over from this one, with all bodies at rest."""
        self._sleepers.wake_all(self.state)
        return Handover(self.model, self._begin.drawn, halted(self.state), self._memory)

    def released(self, forgets: bool = True) -> "Simulation":
        """Return a simulation that goes on from here, not halted any more, and which `forgets` forces between stones.

        A relaxation goes on with θ = 1, as its user does not ask for the motion, and begins with a last halt: forces
        that also stop what is left of a motion would set stones in motion in the next step, in which they are kept.
        Joints that yield would be loaded anew, and move; rigid ones bear the forces of a rest as they lie, and are
        tried first, but beside deformable stones.
        """
        time = self.model.scene.time
        free = replace(time, relaxation=False, theta=1.0 if time.relaxation else time.theta)
        model = replace(self.model, scene=replace(self.model.scene, time=free))
        copied = copy(self)
        copied.model, copied._theta, copied._relax, copied._first = (
            model,
            free.theta,
            Relaxation(model),
            False,
        )
        copied._freed = True
        if copied._solve is not self._given:
            # some methods press stones against what they only touch
            copied._solve = _solver_of(model, replace(model.scene.solver, method=Method.AUTO))
        copied._joints = self._joints.released()
        if time.relaxation:
            copied.state = halted(self.state)
        if free.theta != time.theta:
            with self.clock("assemble"):
                copied._compliance = compliances(model, self._step, free.theta)
        copied._detect = self._detect.continued(model, copied._compliance)
        # forces of elastic stones come from their strain, which stays
        copied._memory = self._memory.at_rest(0.0 if forgets and model.inertia.moving.any() else 1.0)
        copied._sleepers = Sleepers(model, copied.state, copied._memory)
        return copied

    def rests_from_nothing(self) -> bool | None:
        """Return whether rigid stones at rest are so by forces that arise from nothing; None: release them to see.

        If they are not seen to be, the next step begins with these forces. Gaps within the error of a step are closed.
        """
        model, h = self.model, self._step
        if not model.rigid_only or model.laws.sprung:
            return None
        still = halted(self.state)
        predicted = predict(model, self.start, still, h * (1 - self._theta))
        detection = self._detect(model, predicted)
        if not len(detection.contacts.key):
            return None
        _, internal = self._memory.recall(detection.contacts.key, detection.place)
        free = free_kick(model, self.start, predicted, self._compliance, h, self._theta)
        problem, approach = contact_problem(model, predicted, detection, free, internal, None)
        closed = problem.bias <= CLOSED_BIAS * float(np.abs(problem.u_free).max())
        problem = replace(problem, bias=np.where(closed, 0.0, problem.bias))
        rests, impulse = rests_from_nothing(problem)
        if not rests:
            begin = ContactSolution(unshifted(problem, impulse), np.zeros_like(impulse), 0, np.inf, False)
            self._memory.store(detection.contacts.key, begin, approach.state, detection.place)
        return rests

    def carried(self) -> dict[str, Any]:
        """Return what the next step needs to know.

        Contacts, and W, were made at an earlier configuration; compliances hold the nodes that have touched so far.
        Both are made again, in the same order, so that they have the same bits.
        """
        return super().carried() | {
            "detected": self._detect.configuration(self._sleepers.model),
            "condensed": tuple(compliance.condensed for compliance in self._compliance),
            "recess": self._detect.recess,
        }

    def resumed(self, carried: Carried) -> "Simulation":
        """Return the simulation that goes on where another one of the same scene stood; self must not have moved."""
        simulation = self.released() if carried["_freed"] else self
        simulation.restore(carried)
        for compliance, batches in zip(simulation._compliance, carried["condensed"], strict=True):
            compliance.condense_again(batches)
        simulation._detect.repeat(simulation._sleepers.model, carried["detected"], carried["recess"])
        return simulation

    def step(self) -> Step:
        """Advance by one step of the Moreau–Jean θ-scheme (Moreau 1988, Jean 1999; docs/theory.md §2).

            predict   q_m = q_i + h (1-θ) v_i
            detect    gaps g, frames H and W = Hᵀ ŵ H at q_m,      ŵ = (M + hθV + h²θ²K)⁻¹
            state     v_free = v_i + ŵ [ -h V v_i - h K (q_i + hθ v_i) + h P ],      u_free = Hᵀ v_free
            solve     u = W r + u_free,      (u_α, r_α) satisfies its law for every contact α
            advance   v_{i+1} = v_free + ŵ H r,      q_{i+1} = q_m + hθ v_{i+1}

        Stones that sleep are left out; those that the solution disturbs wake, and the step is solved again with them.

        Raises
        ------
        SolverError : if the motion is no longer finite
        """
        h, theta, model, start, clock = self._step, self._theta, self.model, self.start, self.clock
        before, sleepers = self.state, self._sleepers
        with clock("advance"):
            predicted = predict(model, start, before, h * (1 - theta))
            sleepers.begin(before, predicted)
        disturbed = True
        while disturbed:
            detection = self._detect(sleepers.model, predicted)
            with clock("assemble"):
                warm, internal = self._memory.recall(detection.contacts.key, detection.place)
                free = sleepers.hold(free_kick(model, start, predicted, self._compliance, h, theta))
            inputs = predicted, detection, free, internal, self._begin if self._first else None
            problem, approach, solution = self._solved(inputs, warm)
            with clock("advance"):
                r = unshifted(problem, solution.impulse)
                kick = kicked(model, free, detection, r, self._compliance)
                disturbed = sleepers.wake_disturbed(predicted, kick, detection.contacts, r)
        with clock("advance"):
            after = advance(model, start, predicted, kick, h * theta)
            asleep = sleepers.forces, sleepers.wrench
            return self._conclude(
                Step(before, predicted, after, kick, detection, approach, problem, solution, *asleep)
            )

    def _solved(self, inputs: _Given, warm: ContactStart) -> _Solved:
        """Return the problem of a step and its solution: with rigid joints, or compliant ones where these fail."""
        joints, rigid = self._joints, None
        if joints.rigid:
            rigid = self._try(inputs, joints, warm, warm)
            if rigid[2].converged or not self._may_yield or joints.left < 0:
                self._joints = joints.passed()
                return rigid
            joints = joints.needed(rigid[0].delassus, self.model.scene.solver.joint_compliance)
        begin = warm
        for factor in SOFTNESS:
            if factor < joints.softness:
                # so hard they could not be solved in the last step
                continue
            problem, approach, solution = self._try(inputs, joints.softer(factor), warm, begin)
            if solution.converged:
                self._joints = joints.used(factor)
                return problem, approach, solution
            begin = ContactStart(unshifted(problem, solution.impulse), solution.velocity)
        self._joints = self._joints.failed()
        return rigid or self._try(inputs, self._joints, warm, warm)

    def _try(
        self, inputs: _Given, joints: JointCompliance, warm: ContactStart, begin: ContactStart
    ) -> _Solved:
        """State the problem after a step with the impulses of `warm`, and solve it from `begin`.

        Which joints crush is known once it is solved; then it is solved again with these, until they stay the same.
        """
        detection, laws, crushing = inputs[1], self.model.laws, None
        for _ in range(_CRUSHING):
            with self.clock("assemble"):
                problem, approach = contact_problem(self.model, *inputs, joints, warm.impulse, crushing)
            with self.clock("solve"):
                solution = self._solve(problem, shifted(problem, begin))
            if approach.crushing is None:
                break
            crushing = laws.crushing(detection.law, approach, solution.impulse)
            if np.array_equal(crushing, approach.crushing):
                break
            begin = ContactStart(unshifted(problem, solution.impulse), solution.velocity)
        return problem, approach, solution

    def _conclude(self, step: Step) -> Step:
        """Remember a step for the next one, and halt the bodies that relaxation or sleep halts after it."""
        after, detection = step.after, step.found
        if not (np.isfinite(after.velocity).all() and np.isfinite(after.node_velocity).all()):
            raise SolverError(
                f"the velocities are not finite at t = {after.time:.6g} s",
                where=self.model.scene.name,
                remedy="use a smaller time step",
            )
        solution = replace(step.solution, impulse=step.active.impulse)
        self._memory.store(detection.contacts.key, solution, step.active.internal, detection.place)
        self._first = False
        self.state = self._relax(self._sleepers.settle(step))
        if self.state is after:
            return step
        return replace(
            step, relaxed=kinetic_energy(self.model, after) - kinetic_energy(self.model, self.state)
        )


def _solver_of(model: Model, settings: SolverSettings) -> Solver:
    """Return the solver of a model; where only the rest of rigid stones is asked for, it suits their balance."""
    deforms, sprung, time = bool(model.elastic.any()), model.laws.sprung, model.scene.time
    balanced = np.inf if deforms else _BALANCED * time.balance_tolerance
    if time.relaxation:
        exact = min(settings.velocity_tolerance, balanced)
        settings = replace(settings, velocity_tolerance=exact)
    return choose_solver(settings, deforms, sprung, time.duration, balanced)
