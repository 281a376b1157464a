"""Stone on stone: Signorini with gap or with Newton's restitution, Coulomb with static and dynamic friction."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from mechanics.arrays import Array, Bools
from mechanics.scene.laws.law import REST, SLIDING, Approach, Terms
from mechanics.stones.settings import Setting, check_settings
from moma.errors import SceneError

__all__ = ["DryJoint", "DynamicFriction", "Friction", "at_limit", "gap_bias", "slid"]

Friction = Annotated[float, Setting("Coulomb's coefficient μ.", "-", at_least=0)]
DynamicFriction = Annotated[
    float | None,
    Setting("μ of a contact that slid in the last step; `friction` if not given.", "-", at_least=0),
]


# an impulse lies on its cone, to rounding
_ON_CONE = 1.0 - 1e-9
# of a body's size: a contact no farther open than this is closed for Newton's law
_CLOSED = 1e-9
# a contact may rest at the limit of its cone, but for what solvers leave as velocity: slower than this part of the
# speed √(a size), of a fall over the body's size with a = W r/h, it does not slide
_DRIFT = 1e-4


def gap_bias(contacts: Approach) -> Array:
    """Shift of u_N (n,) with which a closing contact is closed at the next kick: g/h, docs/theory.md §3 [m/s]."""
    gap = contacts.gap - contacts.state[:, REST]
    bias: Array = (gap if contacts.push_out else np.maximum(gap, 0.0)) / contacts.step
    return bias


def at_limit(terms: Terms, impulse: Array) -> Bools:
    """Which contacts (n,) are pressed, or held by cohesion, and at the limit of their cone."""
    tangential = np.linalg.norm(impulse[:, 1:], axis=1)
    limit = terms.friction * impulse[:, 0] + terms.cohesion
    on_cone: Bools = (tangential >= _ON_CONE * limit) & ((tangential > 0) | (impulse[:, 0] > 0))
    return on_cone


def slid(contacts: Approach, terms: Terms, impulse: Array, velocity: Array) -> Bools:
    """Which contacts (n,) have slid in the step that gave r̃ (n, d) [N s] and u (n, d) [m/s]."""
    acceleration = contacts.yielding * np.linalg.norm(impulse, axis=1) / contacts.step
    drift = _DRIFT * np.sqrt(acceleration * contacts.size)
    moved: Bools = at_limit(terms, impulse) & (np.linalg.norm(velocity[:, 1:], axis=1) > drift)
    return moved


@dataclass(frozen=True)
class DryJoint:
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

    @property
    def reach(self) -> float:
        """Nothing acts across a gap [m]."""
        return 0.0

    def terms(self, contacts: Approach) -> Terms:
        """Signorini as a shift, friction by what the contact did last."""
        none = np.zeros(len(contacts.gap))
        friction = np.full(len(contacts.gap), self.friction)
        if self.dynamic_friction is not None:
            friction[contacts.state[:, SLIDING] > 0] = self.dynamic_friction
        bias = gap_bias(contacts)
        if self.restitution > 0:
            # Newton's law speaks of closed contacts; an open one waits until it is
            closed = contacts.gap <= _CLOSED * contacts.size
            bias = np.where(closed, self.restitution * np.minimum(contacts.speed, 0.0), np.inf)
        return Terms(bias, friction, none, none)

    def after(self, contacts: Approach, impulse: Array, velocity: Array) -> Array:
        """Remember which contacts slide."""
        state = contacts.state.copy()
        state[:, SLIDING] = slid(contacts, self.terms(contacts), impulse, velocity)
        return state
