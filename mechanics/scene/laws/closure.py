"""Pressure of a joint over its closure: linear, or stiffer with pressure."""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array

FLOOR = 1e-2
"""Pressure over the reference pressure below which the stiffness of a joint stays the same [-]."""


@dataclass(frozen=True)
class Closure:
    """Secant stiffness p/y = k (p/p_f)ⁿ above a pressure p_f, and k below; so that p = p_f (y/y_f)ᵐ, m = 1/(1-n).

    Attributes
    ----------
    stiffness : (n,) k, below the floor and in tension [Pa/m]
    power : m [-]
    floor : p_f; infinite for a linear joint [Pa]
    """

    stiffness: Array
    power: float = 1.0
    floor: float = np.inf

    @property
    def linear(self) -> bool:
        """True where the stiffness is the same at all pressures."""
        return self.power == 1.0

    def _over(self, closure: Array) -> Array:
        """Return y/y_f (n,), one at least."""
        over: Array = np.maximum(closure * self.stiffness / self.floor, 1.0)
        return over

    def pressure(self, closure: Array) -> Array:
        """Return p (n,) at closures y ≥ 0 [Pa]."""
        if self.linear:
            return self.stiffness * closure
        pressure: Array = self.stiffness * closure * self._over(closure) ** (self.power - 1.0)
        return pressure

    def tangent(self, closure: Array) -> Array:
        """Return dp/dy (n,) [Pa/m]."""
        if self.linear:
            return self.stiffness
        over = self._over(closure)
        steeper = np.where(over > 1.0, self.power * over ** (self.power - 1.0), 1.0)
        tangent: Array = self.stiffness * steeper
        return tangent

    def energy(self, closure: Array) -> Array:
        """Return ∫p dy (n,) [J/m²]."""
        if self.linear:
            linear: Array = 0.5 * self.stiffness * closure**2
            return linear
        over, m = self._over(closure), self.power
        below = np.minimum(closure, self.floor / self.stiffness)
        energy: Array = self.stiffness * below**2 * (0.5 + (over ** (m + 1.0) - 1.0) / (m + 1.0))
        return energy

    def at_pressure(self, pressure: float) -> Array:
        """Return the closure y (n,) at a pressure [m]."""
        over = max(pressure / self.floor, 1.0) ** (1.0 / self.power)
        closure: Array = min(pressure, self.floor) / self.stiffness * over
        return closure

    def at_energy(self, energy: Array) -> Array:
        """Return the closure y (n,) at which a joint holds an energy ≥ 0 [m]."""
        m, below = self.power, np.sqrt(2.0 * energy / self.stiffness)
        if self.linear:
            return below
        first = self.floor / self.stiffness
        over = 1.0 + (m + 1.0) * np.maximum(energy / (self.stiffness * first**2) - 0.5, 0.0)
        closure: Array = np.minimum(below, first) * over ** (1.0 / (m + 1.0))
        return closure

    def stiffer(self, pressure: Array) -> Array:
        """Return p/y over k (n,) at pressures [-]."""
        if self.linear:
            return np.ones(len(pressure))
        return np.maximum(pressure / self.floor, 1.0) ** (1.0 - 1.0 / self.power)
