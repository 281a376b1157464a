"""Elastic joint: springs across and along it, with Mohr and Coulomb's strength, as distinct-element codes have it."""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from mechanics.arrays import Array, Bools
from mechanics.scene.laws.bonds import with_bonds
from mechanics.scene.laws.dry_joint import DryJoint, DynamicFriction, Friction, at_limit
from mechanics.scene.laws.law import REST, SPRING, Approach, Law, Springs, Terms
from mechanics.scene.laws.mortar import MortarJoint, check_tension
from mechanics.stones.settings import Setting, check_settings

__all__ = ["ElasticJoint"]

_ALONG = slice(SPRING.start + 1, SPRING.stop)


@dataclass(frozen=True)
class ElasticJoint:
    """Springs k_N and k_T per area of joint, with dashpots c = τk beside them, that open, slide and break.

    With x the gap, or the stretch of the spring along the joint, and both sides of the mean over the step that the
    θ-scheme takes of forces and motions,

        r = -h A (k x̄ + c v̄),     x̄ = x_i + θ h v̄,     v̄ = (1-θ) u_i + θ u

    so that with d = k θ h + c

        u + (k x_i/d + (1-θ) u_i)/θ + E r = 0,     E = 1/(h A d θ)

    holds where the joint neither opens nor slides: a shift of u and a compliance E of the contact. With θ = ½ springs
    keep their energy, with θ = 1 they come to rest. A contact that slides ends with its spring at the limit; one that
    opens, without any stretch. Edges and corners have no area, and are rigid. Overlaps under load are the compression
    of the joint, not an error. Without tensile and shear strength the joint is dry, else mortar (`MortarJoint`).
    """

    friction: Friction
    normal_stiffness: Annotated[float, Setting("Stiffness k_N across the joint, per area.", "Pa/m", above=0)]
    shear_stiffness: Annotated[float, Setting("Stiffness k_T along the joint, per area.", "Pa/m", above=0)]
    damping_time: Annotated[
        float,
        Setting("Dashpots over springs, τ = c/k; a mode of frequency f is damped by π f τ.", "s", at_least=0),
    ] = 0.0
    tension: Annotated[
        float, Setting("Tensile strength c_n; no more than c_t/μ is held.", "Pa", at_least=0)
    ] = 0.0
    shear: Annotated[float, Setting("Shear strength without pressure, c_t.", "Pa", at_least=0)] = 0.0
    dynamic_friction: DynamicFriction = None

    def __post_init__(self) -> None:
        check_settings("elastic joint", self)
        check_tension("elastic joint", self.friction, self.tension, self.shear)
        _ = self._strength  # checks the dynamic friction

    @property
    def reach(self) -> float:
        """Zero: no force acts across a gap, except that of a bond, which yields by less than is watched anyway [m]."""
        return 0.0

    @property
    def bonded(self) -> bool:
        """True for mortar, which holds tension or shear without pressure."""
        return self.shear > 0 or self.tension > 0

    @property
    def _strength(self) -> Law:
        if self.bonded:
            return MortarJoint(self.friction, self.tension, self.shear, self.dynamic_friction)
        return DryJoint(self.friction, self.dynamic_friction)

    def terms(self, contacts: Approach) -> Terms:
        """Return the strength of the joint, with its springs."""
        strength = self._strength.terms(contacts)
        contacts = with_bonds(contacts) if self.bonded else contacts
        step, theta, has = contacts.step, contacts.theta, contacts.area > 0
        begin = contacts.gap - contacts.state[:, REST] - step * (1.0 - theta) * contacts.speed
        compliance, shift = np.zeros((len(has), 3)), np.zeros((len(has), 2))
        area = np.where(has, contacts.area, 1.0)
        for columns, stiffness in ((slice(0, 1), self.normal_stiffness), (slice(1, 3), self.shear_stiffness)):
            compliance[:, columns] = (has / (step * theta * self._hold(contacts, stiffness) * area))[:, None]
        across = self._lag(contacts, self.normal_stiffness, begin, contacts.speed)
        along = self._lag(contacts, self.shear_stiffness, contacts.state[:, _ALONG], contacts.slide)
        shift[has] = along[has]
        return replace(
            strength, bias=np.where(has, across, strength.bias), springs=Springs(compliance, shift)
        )

    def after(self, contacts: Approach, impulse: Array, velocity: Array) -> Array:
        """Return the internal variables with the stretch of the springs along the joint at the end of the step."""
        strength = self._strength.terms(contacts)
        step, theta, has = contacts.step, contacts.theta, contacts.area > 0
        area, stiffness = np.where(has, contacts.area, np.inf)[:, None], self.shear_stiffness
        stretch = contacts.state[:, _ALONG]
        traction = -impulse[:, 1:] / (step * area)
        rate = (traction - stiffness * stretch) / self._hold(contacts, stiffness)
        mean = (1.0 - theta) * contacts.slide + theta * velocity[:, 1:]
        slip = velocity.copy()
        slip[has, 1:] = (mean - rate)[has]
        state = self._strength.after(contacts, impulse, slip)
        held = np.where(at_limit(strength, impulse)[:, None], traction / stiffness, stretch + step * rate)
        closed: Bools = has & (impulse[:, 0] > 0)
        state[:, SPRING.start] = 0.0
        state[:, _ALONG] = np.where(closed[:, None], held, 0.0)
        return state

    def _hold(self, contacts: Approach, stiffness: float) -> float:
        """Return d = k θ h + c, traction per mean velocity of the step [Pa s/m]."""
        return stiffness * (contacts.theta * contacts.step + self.damping_time)

    def _lag(self, contacts: Approach, stiffness: float, begin: Array, speed: Array) -> Array:
        """Return the shift of u by springs that begin the step with a stretch [m] and its rate [m/s]."""
        theta = contacts.theta
        lag: Array = (stiffness / self._hold(contacts, stiffness) * begin + (1.0 - theta) * speed) / theta
        return lag
