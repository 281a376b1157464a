"""From contacts and their laws to the contact problem of one step: a shift, a cone, and W."""

from dataclasses import replace

import numpy as np

from mechanics.arrays import Array
from mechanics.contact.contacts import gaps
from mechanics.delassus.assembly import local_velocity
from mechanics.dynamics.contact_search import Detection
from mechanics.dynamics.stepping import Kick
from mechanics.model.model import Model
from mechanics.problem.problem import ContactProblem, ContactStart
from mechanics.scene.laws.law import REST, Approach, Terms
from mechanics.scene.state import State
from mechanics.stones.validation import SMALLEST

__all__ = ["contact_problem", "shifted", "terms_of", "unshifted"]


_TOUCH = 1e-9  # overlap over a body's size that comes from rounding, and is no property of a joint [-]
# bias of a law that does not act in a step, over the fastest free velocity: its own, infinity, is no number to solvers
_NEVER = 1e3


def contact_problem(
    model: Model, predicted: State, found: Detection, free: Kick, internal: Array, begin: State | None
) -> tuple[ContactProblem, Approach]:
    """State the problem u = W r̃ + (u_free - W s n), (u, r̃) in the shift and cone of its law, for r̃ = r + s n.

    Stones that overlap as the run begins touch: survey and rounding leave such joints, and nothing moves because of
    them. The gap of that instant counts as closed from then on, so that only what overlaps deeper later is corrected.

    Parameters
    ----------
    model, predicted : the bodies at the instant of the kick
    found : their contacts
    free : velocities without contact impulses
    internal : (nc, STATE) internal variables of the laws
    begin : the state in which the run begins, in its first step; None in later ones

    Returns
    -------
    problem : for a solver; its impulses are r̃
    approach : the contacts as the laws see them before the step
    """
    contacts, operator, time = found.contacts, found.operator, model.scene.time
    gap = gaps(contacts, predicted)
    speed = local_velocity(contacts, operator, predicted.velocity, predicted.node_velocity)[:, 0]
    size = model.surfaces.size[contacts.bodies].min(axis=1)
    if begin is not None:
        initial = gaps(contacts, begin)
        elastic = model.elastic[contacts.bodies].any(axis=1)
        # a ball dents a meshed face by what the mesh does not see of it
        round_ = model.surfaces.radius[model.surfaces.sptr[:-1]][contacts.bodies].any(axis=1)
        overlaps = (initial < -_TOUCH * size) & ~(round_ & elastic)
        internal = internal.copy()
        internal[:, REST] = np.where(overlaps, initial, internal[:, REST])
    approach = Approach(
        gap=gap,
        speed=speed,
        area=contacts.area,
        size=size,
        compliance=operator.diagonal[:, 0, 0],
        step=time.step,
        theta=time.theta,
        push_out=time.relaxation,
        first=begin is not None,
        state=internal,
    )
    terms = model.laws.terms(found.law, approach)
    u_free = local_velocity(contacts, operator, free.velocity, free.node_velocity)
    if terms.adhesion.any():
        pull = np.zeros_like(u_free)
        pull[:, 0] = terms.adhesion
        u_free = u_free - operator.apply(pull)
    open_ = ~np.isfinite(terms.bias)
    if open_.any():
        never = _NEVER * (float(np.abs(u_free).max()) + 1e-300)
        terms = replace(terms, bias=np.where(open_, never, terms.bias))
    if max(float(np.abs(one).max(initial=0.0)) for one in (u_free, terms.bias)) < SMALLEST:
        # a motion that has died out is too slow for its squares to be numbers
        u_free, terms = np.zeros_like(u_free), replace(terms, bias=np.zeros_like(terms.bias))
    problem = ContactProblem(operator, u_free, terms.bias, terms.friction, terms.cohesion, terms.adhesion)
    return problem, approach


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
