"""Refusals of contact problems that no solver can solve: NaN, no compliance, numbers too large to square."""

from collections.abc import Mapping

import numpy as np

from ground.errors import SolverError
from mechanics.arrays import Array
from mechanics.stones.validation import LARGEST, SMALLEST

_WHERE = "contact problem"
_UNITS = "take units in which they are nearer to 1"


def require_finite(**arrays: Array) -> None:
    """Refuse arrays, one row for each contact, with an entry that is not finite.

    Raises
    ------
    SolverError : naming the array, the contact and the value
    """
    for name, values in arrays.items():
        finite = np.isfinite(values)
        if not finite.all():
            place = tuple(int(i) for i in np.argwhere(~finite)[0])
            raise SolverError(
                f"{name} of contact {place[0]} is {values[place]}",
                where=_WHERE,
                remedy="correct what it was made from; in a run, take a smaller time step",
            )


def check_problem(diagonal: Array, u_free: Array, **each: Array | None) -> None:
    """Refuse problems that cannot be solved.

    Parameters
    ----------
    diagonal : (nc, d, d) W_αα [1/kg]
    u_free : (nc, d) [m/s]
    each : (nc,) bias [m/s], friction [-], cohesion and adhesion [N s], by name; None where absent

    Raises
    ------
    SolverError : with the number of the contact, the value and a remedy
    """
    arrays = {name: values for name, values in each.items() if values is not None}
    _check_shapes(diagonal, u_free, arrays)
    if len(u_free) == 0:
        return
    require_finite(u_free=u_free, **arrays)
    for name, values in arrays.items():
        if name != "bias" and values.min() < 0:
            contact = int(values.argmin())
            raise SolverError(
                f"{name} of contact {contact} is {values[contact]:g}", where=_WHERE, remedy="give 0 or more"
            )
    check_compliance(diagonal)
    fastest = max(float(np.abs(u_free).max()), float(np.abs(arrays["bias"]).max()))
    if not (fastest == 0 or SMALLEST <= fastest <= LARGEST):
        raise SolverError(f"velocities of {fastest:.3g} m/s at most", where=_WHERE, remedy=_UNITS)


def check_compliance(diagonal: Array) -> None:
    """Refuse contacts without compliance (nc, d, d), or with one that is not finite."""
    sound = np.isfinite(diagonal).all(axis=(1, 2))
    if not sound.all():
        raise SolverError(
            f"W of contact {int(np.argmin(sound))} is not finite",
            where=_WHERE,
            remedy="correct its bodies: masses and moments of inertia greater than 0, places that are numbers",
        )
    diagonals = np.einsum("cii->ci", diagonal)
    if not (diagonals > 0).all():
        contact, axis = (int(i) for i in np.argwhere(~(diagonals > 0))[0])
        raise SolverError(
            f"contact {contact} does not give way along axis {axis} (W = {diagonals[contact, axis]:g})",
            where=_WHERE,
            remedy="a contact needs a body that moves, of a mass greater than 0; leave others out",
        )
    if diagonals.max() > LARGEST or diagonals.min() < SMALLEST:
        raise SolverError(
            f"W of {diagonals.min():.3g} to {diagonals.max():.3g} 1/kg", where=_WHERE, remedy=_UNITS
        )


def _check_shapes(diagonal: Array, u_free: Array, each: Mapping[str, Array]) -> None:
    count, size = u_free.shape if u_free.ndim == 2 else (-1, -1)
    wrong = [f"{name} has shape {values.shape}" for name, values in each.items() if values.shape != (count,)]
    if diagonal.shape != (count, size, size):
        wrong.append(f"W has blocks {diagonal.shape}")
    if wrong:
        raise SolverError(
            f"{' and '.join(wrong)}, u_free {u_free.shape}",
            where=_WHERE,
            remedy="give one row for each contact",
        )
