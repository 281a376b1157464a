"""Stone on stone: Signorini with gap or with Newton's restitution, Coulomb with static and dynamic friction."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechanics.laws.law import SLIDING, Approach, Terms
from moma.errors import SceneError

__all__ = ["DryJoint", "gap_bias", "sliding"]

Array = NDArray[np.float64]

# a contact slides when its impulse lies on the cone, to rounding
_ON_CONE = 1.0 - 1e-9
# of a body's size: a contact no farther open than this is closed for Newton's law
_CLOSED = 1e-9


def gap_bias(contacts: Approach) -> Array:
    """Shift of u_N (n,) with which a closing contact lands exactly: g/(hθ), docs/theory.md §3 [m/s]."""
    gap = contacts.gap if contacts.push_out else np.maximum(contacts.gap, 0.0)
    bias: Array = gap / (contacts.step * contacts.theta)
    return bias


def sliding(terms: Terms, impulse: Array) -> NDArray[np.bool_]:
    """Which contacts (n,) are at the limit of their cone."""
    tangential = np.linalg.norm(impulse[:, 1:], axis=1)
    limit = terms.friction * impulse[:, 0] + terms.cohesion
    at_limit: NDArray[np.bool_] = (tangential >= _ON_CONE * limit) & (tangential > 0)
    return at_limit


@dataclass(frozen=True)
class DryJoint:
    """Unilateral contact without cohesion.

    Attributes
    ----------
    friction : Coulomb's μ while sticking [-]
    dynamic_friction : μ of a contact that slid in the last step; None: the same [-]
    restitution : Newton's e, 0 ≤ e ≤ 1; 0 lands inelastically, in time with the gap [-]
    """

    friction: float = 0.6
    dynamic_friction: float | None = None
    restitution: float = 0.0

    def __post_init__(self) -> None:
        dynamic = self.friction if self.dynamic_friction is None else self.dynamic_friction
        for quantity, value, ok, remedy in (
            ("friction", self.friction, self.friction >= 0, "give a coefficient of 0 or more"),
            (
                "dynamic_friction",
                dynamic,
                0 <= dynamic <= self.friction,
                "give from 0 up to the static friction",
            ),
            ("restitution", self.restitution, 0 <= self.restitution <= 1, "give a ratio from 0 to 1"),
        ):
            if not ok:
                raise SceneError(f"{quantity} = {value!r}", where="dry joint", remedy=remedy)

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
        state[:, SLIDING] = sliding(self.terms(contacts), impulse)
        return state
