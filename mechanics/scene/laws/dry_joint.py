"""Dry joint: Signorini with gap or with Newton restitution, Coulomb with static and dynamic friction."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ground.errors import SceneError
from ground.settings import Setting
from mechanics.arrays import Array, Bools
from mechanics.scene.laws.law import REST, SLIDING, Approach, Joint, Terms
from mechanics.stones.settings import check_settings

Friction = Annotated[float, Setting("Coulomb's coefficient μ.", "-", at_least=0)]
DynamicFriction = Annotated[
    float | None,
    Setting("μ of a contact that slid in the last step; `friction` if not given.", "-", at_least=0),
]


_ON_CONE = (
    1.0 - 1e-9
)  # tangential impulse over its limit, from which an impulse lies on its cone, to rounding [-]
_CLOSED = 1e-9  # gap over a body's size up to which a contact is closed for Newton's law [-]
_DRIFT = 1e-4  # of √(a size), a = W r/h, the speed below which a contact at its limit rests: solvers leave as much [-]


def gap_bias(contacts: Approach) -> Array:
    """Return the shift g/h of u_N (n,), with which a contact closes at the next kick (docs/theory.md §3) [m/s]."""
    gap = contacts.gap - contacts.state[:, REST]
    bias: Array = (gap if contacts.push_out else np.maximum(gap, 0.0)) / contacts.step
    return bias


def at_limit(terms: Terms, impulse: Array) -> Bools:
    """Return the contacts (n,) under pressure, or held by cohesion, at the limit of their cone."""
    tangential = _length(impulse[:, 1:])
    limit = terms.friction * impulse[:, 0] + terms.cohesion
    on_cone: Bools = (tangential >= _ON_CONE * limit) & ((tangential > 0) | (impulse[:, 0] > 0))
    return on_cone


def _length(vectors: Array) -> Array:
    """Return the lengths (n,) of vectors (n, d)."""
    length: Array = np.sqrt(np.einsum("ci,ci->c", vectors, vectors))
    return length


def slid(contacts: Approach, terms: Terms, impulse: Array, velocity: Array) -> Bools:
    """Return the contacts (n,) that slid in the step with r̃ (n, d) [N s] and u (n, d) [m/s]."""
    acceleration = contacts.compliance * _length(impulse) / contacts.step
    drift = _DRIFT * np.sqrt(acceleration * contacts.size)
    moved: Bools = at_limit(terms, impulse) & (_length(velocity[:, 1:]) > drift)
    return moved


@dataclass(frozen=True)
class DryJoint(Joint):
    """Unilateral contact without cohesion. Without restitution a stone lands inelastically, in time with the gap."""

    friction: Friction = 0.6
    dynamic_friction: DynamicFriction = None
    restitution: Annotated[
        float,
        Setting("Newton's ratio e of the velocities after and before an impact.", "-", at_least=0, at_most=1),
    ] = 0.0

    def __post_init__(self) -> None:
        check_settings("dry joint", self)
        if self.dynamic_friction is not None and self.dynamic_friction > self.friction:
            raise SceneError(
                f"dynamic_friction = {self.dynamic_friction!r}",
                where="dry joint",
                remedy=f"give from 0 up to the static friction, {self.friction:g}",
            )

    def terms(self, contacts: Approach) -> Terms:
        """Return Signorini as a shift, with dynamic friction for contacts that slid in the last step."""
        none = np.zeros(len(contacts.gap))
        friction = np.full(len(contacts.gap), self.friction)
        if self.dynamic_friction is not None:
            friction[contacts.state[:, SLIDING] > 0] = self.dynamic_friction
        bias = gap_bias(contacts)
        if self.restitution > 0:
            # Newton's law holds for closed contacts only
            closed = contacts.gap <= _CLOSED * contacts.size
            bias = np.where(closed, self.restitution * np.minimum(contacts.speed, 0.0), np.inf)
        return Terms(bias, friction, none, none)

    def after(self, contacts: Approach, impulse: Array, velocity: Array) -> Array:
        """Return the internal variables with the contacts that slide."""
        state = contacts.state.copy()
        state[:, SLIDING] = slid(contacts, self.terms(contacts), impulse, velocity)
        return state
