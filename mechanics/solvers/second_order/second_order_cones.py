"""Many second-order cones x₀ ≥ ‖(x₁, x₂)‖ at once, one in each row (nc, 3) (Alizadeh & Goldfarb 2003)."""

from dataclasses import dataclass

import numpy as np

from ground.errors import SolverError
from mechanics.arrays import Array

_MIRROR = np.array([1.0, -1.0, -1.0])


def product(x: Array, y: Array) -> Array:
    """Return Jordan's product x ∘ y = (x·y, x₀ y_T + y₀ x_T)."""
    return np.column_stack([x[:, 0] * y[:, 0] + _dot(x, y), x[:, :1] * y[:, 1:] + y[:, :1] * x[:, 1:]])


def divide(x: Array, y: Array) -> Array:
    """Return the z with x ∘ z = y, for x inside its cone."""
    first = (x[:, 0] * y[:, 0] - _dot(x, y)) / _determinant(x)
    return np.column_stack([first, (y[:, 1:] - first[:, None] * x[:, 1:]) / x[:, :1]])


def central(difference: Array, level: float) -> tuple[Array, Array]:
    """Return the s and z inside the cones with s - z = `difference` (nc, 3) and s ∘ z = `level` e (Fukushima 2002).

    >>> s, z = central(np.array([[3.0, 0.0, 0.0]]), 4.0)
    >>> float(s[0, 0]), float(z[0, 0])
    (4.0, 1.0)
    """
    size = tangential(difference)
    along = difference[:, 1:] / np.maximum(size, 1e-300)[:, None]
    first, second = difference[:, 0] + size, difference[:, 0] - size
    return _spectral(first, second, along, level), _spectral(-second, -first, -along, level)


def to_bounds(x: Array, low: float, high: float) -> Array:
    """Return the change (nc, 3) that brings the eigenvalues of x between two bounds, none down by more than `high`.

    >>> to_bounds(np.array([[3.0, 2.0, 0.0]]), 2.0, 4.0)[0, :2]
    array([ 0., -1.])
    """
    size = tangential(x)
    along = x[:, 1:] / np.maximum(size, 1e-300)[:, None]
    upper, lower = (
        np.maximum(np.clip(eigenvalue, low, high) - eigenvalue, -high)
        for eigenvalue in (x[:, 0] + size, x[:, 0] - size)
    )
    return np.column_stack([0.5 * (upper + lower), 0.5 * (upper - lower)[:, None] * along])


def _spectral(first: Array, second: Array, along: Array, level: float) -> Array:
    """Return the elements (nc, 3) whose eigenvalues are the positive roots of λ² - p λ = level for two p (nc,)."""
    first_root, two = _root(first, level), _root(second, level)
    return np.column_stack([0.5 * (first_root + two), 0.5 * (first_root - two)[:, None] * along])


def _root(p: Array, level: float) -> Array:
    # without cancellation for p < 0
    whole = 0.5 * (np.abs(p) + np.sqrt(p * p + 4.0 * level))
    root: Array = np.where(p >= 0, whole, level / whole)
    return root


def reach(x: Array, step: Array) -> float:
    """Return the largest a with x + a · step in all cones, for x inside them; infinite if there is none."""
    a = step[:, 0] ** 2 - _dot(step, step)
    b = 2.0 * (x[:, 0] * step[:, 0] - _dot(x, step))
    c = _determinant(x)
    # the roots of a α² + b α + c without cancellation; the first positive one is where the cone is left
    q = -0.5 * (b + np.where(b >= 0, 1.0, -1.0) * np.sqrt(np.maximum(b * b - 4.0 * a * c, 0.0)))
    with np.errstate(all="ignore"):
        roots = np.column_stack([q / a, c / q, np.where(step[:, 0] < 0, -x[:, 0] / step[:, 0], np.inf)])
    roots[~(roots > 0)] = np.inf
    return float(roots.min(initial=np.inf))


def tangential(x: Array) -> Array:
    """Return ‖(x₁, x₂)‖ (nc,)."""
    size: Array = np.sqrt(_dot(x, x))
    return size


def _dot(x: Array, y: Array) -> Array:
    # a sum over an axis of two takes five times as long
    result: Array = x[:, 1] * y[:, 1] + x[:, 2] * y[:, 2]
    return result


def _determinant(x: Array) -> Array:
    size = tangential(x)
    result: Array = (x[:, 0] - size) * (x[:, 0] + size)
    return result


@dataclass(frozen=True)
class Scaling:
    """Matrices T with T z = T⁻¹ s, symmetric, that keep the cones (Nesterov & Todd 1997).

    Attributes
    ----------
    axis : (nc, 3) on the unit hyperboloid
    size : (nc,)
    """

    axis: Array
    size: Array

    def __call__(self, x: Array) -> Array:
        """Return T x."""
        return self._apply(self.axis, x) * self.size[:, None]

    def inverse(self, x: Array) -> Array:
        """Return T⁻¹ x."""
        return self._apply(self.axis * _MIRROR, x) / self.size[:, None]

    @property
    def inverse_squared(self) -> Array:
        """T⁻² (nc, 3, 3)."""
        v = self.axis * _MIRROR
        square = 2.0 * v[:, :, None] * v[:, None, :] - np.diag(_MIRROR)
        result: Array = square / (self.size**2)[:, None, None]
        return result

    @staticmethod
    def _apply(axis: Array, x: Array) -> Array:
        along = _dot(axis, x)
        rest = x[:, 1:] + (x[:, 0] + along / (1.0 + axis[:, 0]))[:, None] * axis[:, 1:]
        return np.column_stack([axis[:, 0] * x[:, 0] + along, rest])


def scaling(s: Array, z: Array) -> Scaling:
    """Return the scaling of s and z (nc, 3), both inside their cones.

    Raises
    ------
    SolverError : if one is not, which near the boundary rounding may do
    """
    inside = _determinant(s), _determinant(z)
    if not (np.minimum(*inside) > 0).all():
        raise SolverError("rounding has left the cones", where="interior point", remedy="ask for less")
    slack_scale, dual_scale = np.sqrt(inside[0]), np.sqrt(inside[1])
    unit, dual = s / slack_scale[:, None], z / dual_scale[:, None]
    gamma = np.sqrt(0.5 * (1.0 + unit[:, 0] * dual[:, 0] + _dot(unit, dual)))
    return Scaling((unit + _MIRROR * dual) / (2.0 * gamma[:, None]), np.sqrt(slack_scale / dual_scale))
