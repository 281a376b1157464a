"""From contacts and their laws to the contact problem of one step: a shift, a cone, and W.

Between rigid joints

    0 ≤ u_N + g/h ⊥ r_N ≥ 0

may have no solution, or one that no method finds: stones that real geometry clamps from several sides, through slivers
and overlaps. A compliant joint is an elastic layer of stiffness 1/(ε h²), the same in all joints:

    0 ≤ u_N + g/h + ε r_N ⊥ r_N ≥ 0,      u_T + ε (r_T - r_T of the last step) in Coulomb's law

so that W + ε stands for W, and stones overlap by ε h r_N = ε h² F. The gap g is signed: where forces stay the same
nothing moves, neither across the joint nor along it (docs/design/joints-that-yield.md).
"""

from dataclasses import dataclass, replace

import numpy as np

from ground.errors import SceneError
from mechanics.arrays import Array, Bools
from mechanics.contact.contacts import PAIR_BIT, Contacts, gaps
from mechanics.delassus.assembly import local_velocity
from mechanics.delassus.compliant import CompliantDelassus
from mechanics.dynamics.contact_search import Detection
from mechanics.dynamics.handover import Beginning
from mechanics.dynamics.stepping import Kick
from mechanics.model.model import Model
from mechanics.problem.problem import ContactProblem, ContactStart, Delassus, mean_diagonal
from mechanics.scene.laws.law import REST, SPRING, Approach, Springs, Terms
from mechanics.scene.scene import Method
from mechanics.scene.state import State
from mechanics.stones.validation import SMALLEST

_TOUCH = 1e-9  # overlap over a body's size that comes from rounding, and is no property of a joint [-]
# bias of a law that does not act in a step, over the fastest free velocity: its own, infinity, is no number to solvers
_NEVER = 1e3
# overlap over that of the largest force, from which it comes from no force of a compliant joint [-]
_UNEXPLAINED = 4.0


SOFTNESS = (1.0, 3.0, 10.0)
"""Factors on the compliance of joints, tried in turn where a step cannot be solved with it either."""

# compliant steps after which rigid joints are tried again, at first; twice as many after each failure
_FIRST_WAIT = 8


def may_yield(model: Model) -> bool:
    """Return whether joints of a run may yield: on the way to a rest alone, as in a motion they would decide it.

    Joints with springs of their own yield in every step; where most stones deform, these do.
    """
    settings, elastic = model.scene.solver, int(model.elastic.sum())
    automatic = settings.method is Method.AUTO and settings.joint_compliance > 0
    rest = model.scene.time.relaxation and not model.laws.sprung
    return automatic and rest and not 0 < elastic >= int(model.inertia.moving.sum())


@dataclass(frozen=True)
class JointCompliance:
    """Compliance of the joints of a run: none until a step with rigid joints could not be solved.

    Attributes
    ----------
    value : ε of all joints once it has been needed, kept from then on; 0 until then [1/kg]
    left : steps with compliant joints still to come, before rigid joints are tried again; negative: steps that are left
        to rigid joints alone, as compliant ones have failed, too
    wait : number of steps after the next failure of either
    softness : factor on ε with which the last step with compliant joints was solved [-]
    lasting : once needed, joints stay compliant: where stones deform, too, by as much
    """

    value: float = 0.0
    left: int = 0
    wait: int = _FIRST_WAIT
    softness: float = 1.0
    lasting: bool = False

    @property
    def rigid(self) -> bool:
        """True where the next step is tried with rigid joints."""
        return self.left <= 0

    def needed(self, operator: Delassus, share: float) -> "JointCompliance":
        """Return the state after a failure with rigid joints: ε is a share of the mean diagonal of W [-]."""
        value = self.value or share * mean_diagonal(operator.diagonal)
        return replace(self, value=value, left=self.wait, wait=2 * self.wait, softness=1.0)

    def softer(self, factor: float) -> "JointCompliance":
        """Return the state with joints that many times as compliant."""
        return replace(self, value=factor * self.value)

    def used(self, softness: float) -> "JointCompliance":
        """Return the state after a step with compliant joints."""
        return replace(self, left=self.left - (not self.lasting), softness=softness)

    def released(self) -> "JointCompliance":
        """Return the state in which forces are forgotten, which rigid joints bear as they lie, if they may be tried."""
        return self if self.lasting else replace(self, left=min(self.left, 0))

    def failed(self) -> "JointCompliance":
        """Return the state after a step that could not be solved at all."""
        return replace(self, left=-self.wait, wait=2 * self.wait)

    def passed(self) -> "JointCompliance":
        """Return the state after a step with rigid joints."""
        return replace(self, left=min(self.left + 1, 0))


_RIGID = JointCompliance()


def contact_problem(
    model: Model,
    predicted: State,
    detection: Detection,
    free: Kick,
    internal: Array,
    begin: Beginning | None,
    joints: JointCompliance = _RIGID,
    last: Array | None = None,
    crushing: Bools | None = None,
) -> tuple[ContactProblem, Approach]:
    """State the problem u = W r̃ + (u_free - W s n), (u, r̃) in the shift and cone of its law, for r̃ = r + s n.

    Stones that overlap as they meet, when the run or a stage of building begins, touch: survey and rounding leave such
    joints, and nothing moves because of them. The gap of that instant counts as closed from then on, so that only what
    overlaps deeper later is corrected. So do the beds of stones that are laid on others which have moved.

    Parameters
    ----------
    model, predicted : the bodies at the instant of the kick
    detection : their contacts
    free : velocities without contact impulses
    internal : (nc, STATE) internal variables of the laws
    begin : how the run begins, in its first step; None in later ones
    joints : their compliance; the joints of this step are compliant where rigid ones are not to be tried
    last : (nc, 3) r of the last step, zero for new contacts, from which compliant joints go on; None: zero [N s]
    crushing : (nc,) contacts whose joints crush in this step; None: those that are at their strength and close

    Returns
    -------
    problem : for a solver; its impulses are r̃
    approach : the contacts as the laws see them before the step
    """
    contacts, operator, time = detection.contacts, detection.operator, model.scene.time
    # stones without a common area touch once they lie in each other by their recess
    gap = gaps(contacts, predicted) + detection.recess
    motion = local_velocity(contacts, operator, predicted.velocity, predicted.node_velocity)
    size = np.minimum(*model.surfaces.size[contacts.bodies.T])
    if begin is not None:
        initial, meets = gaps(contacts, begin.state) + detection.recess, begin.meets(contacts.bodies)
        closed = begin.closed(initial, gaps(contacts, begin.drawn) + detection.recess)
        elastic = model.elastic[contacts.bodies].any(axis=1)
        # a ball dents a meshed face by what the mesh does not see of it
        round_ = model.surfaces.radius[model.surfaces.sptr[:-1]][contacts.bodies].any(axis=1)
        closes = meets & (np.abs(closed) > _TOUCH * size) & ~(round_ & elastic)
        internal = internal.copy()
        internal[:, REST] = np.where(closes, closed, internal[:, REST])
    else:
        meets = np.zeros(len(gap), dtype=bool)
    sprung = model.laws.sprung
    approach = Approach(
        gap=gap,
        speed=motion[:, 0],
        slide=motion[:, 1:],
        area=contacts.area,
        size=size,
        compliance=operator.diagonal[:, 0, 0],
        step=time.step,
        theta=time.theta,
        # a compliant joint answers to its overlap; rigid ones between two such steps keep it
        push_out=time.relaxation if joints.value == 0 else not joints.rigid,
        pair=np.unique(contacts.key >> PAIR_BIT, return_inverse=True)[1]
        if sprung
        else np.zeros_like(contacts.key),
        first=meets,
        state=internal,
        thickness=_thickness(model, detection),
    )
    before = np.zeros((len(gap), 3)) if last is None else last
    if model.laws.sprung:
        approach = replace(approach, state=turned_springs(approach.state, spring_axes(contacts, predicted)))
    if model.laws.crushes:
        guess = model.laws.crushing(detection.law, approach) if crushing is None else crushing
        approach = replace(approach, crushing=guess)
    if not joints.rigid:
        approach = _explained(approach, joints.value, before)
    terms = model.laws.terms(detection.law, approach)
    u_free = local_velocity(contacts, operator, free.velocity, free.node_velocity)
    if terms.adhesion.any():
        pull = np.zeros_like(u_free)
        pull[:, 0] = terms.adhesion
        u_free = u_free - operator.apply(pull)
    open_ = ~np.isfinite(terms.bias)
    if open_.any():
        never = _NEVER * (float(np.abs(u_free).max()) + 1e-300)
        terms = replace(terms, bias=np.where(open_, never, terms.bias))
    if max(float(np.abs(velocity).max(initial=0.0)) for velocity in (u_free, terms.bias)) < SMALLEST:
        # a motion that has died out is too slow for its squares to be numbers
        u_free, terms = np.zeros_like(u_free), replace(terms, bias=np.zeros_like(terms.bias))
    problem = ContactProblem(operator, u_free, terms.bias, terms.friction, terms.cohesion, terms.adhesion)
    if terms.springs is not None:
        problem = _sprung(problem, terms.springs)
    return problem if joints.rigid else _compliant(problem, joints.value, before), approach


def _thickness(model: Model, detection: Detection) -> Array | None:
    """Return the thickness of mortar (nc,) of contacts, zero where no law needs it [m].

    Raises
    ------
    SceneError : two stones whose joint has no thickness, although its law needs it
    """
    contacts = detection.contacts
    thickness = model.laws.thickness(detection.law, contacts.bodies)
    if thickness is None:
        return None
    lacks = np.flatnonzero(np.isnan(thickness) & (contacts.area > 0))
    if len(lacks):
        first, second = sorted(model.scene.blocks[b].code for b in contacts.bodies[lacks[0]])
        raise SceneError(
            f"no thickness of the mortar between {first} and {second}",
            where=model.scene.name,
            remedy="give thickness beside mortar_young in the law of this joint, for pairs of which none is known",
        )
    filled: Array = np.where(np.isnan(thickness), 0.0, thickness)
    return filled


def spring_axes(contacts: Contacts, state: State) -> Array:
    """Return the matrices (nc, 3, 3) that turn the stretch of a spring from its own axes into the frame of a contact.

    Which of two faces carries the frame of a joint changes as stones turn by a millionth, and with it the candidate.
    Its springs are kept as the displacement of the body of the lower number over the other, in its axes.
    """
    sign = np.where(contacts.bodies[:, 0] < contacts.bodies[:, 1], 1.0, -1.0)
    axes: Array = sign[:, None, None] * (contacts.frame @ state.rotation[contacts.bodies.min(axis=1)])
    return axes


def turned_springs(internal: Array, axes: Array) -> Array:
    """Return internal variables (nc, STATE) with the stretch of their springs turned by matrices (nc, 3, 3)."""
    turned = internal.copy()
    turned[:, SPRING] = np.einsum("cij,cj->ci", axes, internal[:, SPRING])
    return turned


def _explained(approach: Approach, compliance: float, last: Array) -> Approach:
    """Return the contacts where overlaps that come from no force count as closed, as those at the start of a run do."""
    state = approach.state.copy()
    deepest = _UNEXPLAINED * compliance * approach.step * float(last[:, 0].max(initial=0.0))
    strange = approach.gap - state[:, REST] < -deepest
    state[:, REST] = np.where(strange, approach.gap, state[:, REST])
    return replace(approach, state=state)


def _sprung(problem: ContactProblem, springs: Springs) -> ContactProblem:
    """Return the problem of joints with springs of their own: W + E, for the impulses r = r̃ - s n that they feel."""
    assert problem.adhesion is not None
    u_free = problem.u_free.copy()
    u_free[:, 0] -= springs.compliance[:, 0] * problem.adhesion
    u_free[:, 1:] += springs.shift
    return replace(problem, delassus=CompliantDelassus(problem.delassus, springs.compliance), u_free=u_free)


def _compliant(problem: ContactProblem, compliance: float, last: Array) -> ContactProblem:
    """Return the problem with W + E; the gaps are signed already."""
    assert problem.adhesion is not None
    joint_state = last.copy()
    # of a shifted impulse r̃ = r + s n the joint feels r
    joint_state[:, 0] = problem.adhesion
    each = np.full_like(last, compliance)
    return replace(
        problem,
        delassus=CompliantDelassus(problem.delassus, each),
        u_free=problem.u_free - each * joint_state,
    )


def terms_of(problem: ContactProblem) -> Terms:
    """Return the laws of a problem, as shift and cone."""
    assert problem.adhesion is not None
    return Terms(problem.bias, problem.friction, problem.cohesion, problem.adhesion)


def shifted(problem: ContactProblem, start: ContactStart) -> ContactStart:
    """Return a warm start in r̃ = r + s n, in which the problem is stated, from one in r."""
    ahead = None if start.ahead is None else shifted(problem, start.ahead)
    return replace(start, impulse=_moved(problem, start.impulse, 1.0), ahead=ahead)


def unshifted(problem: ContactProblem, impulse: Array) -> Array:
    """Return r = r̃ - s n (nc, 3), the true impulses, from r̃ [N s]."""
    return _moved(problem, impulse, -1.0)


def _moved(problem: ContactProblem, impulse: Array, sign: float) -> Array:
    if problem.adhesion is None or not problem.adhesion.any():
        return impulse
    moved = impulse.copy()
    moved[:, 0] += sign * problem.adhesion
    return moved
