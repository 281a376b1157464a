"""Correction of overlaps after a step: disks are moved apart, and their velocities stay as they are.

A step that is not solved to the end lets disks sink into each other by a little, which adds up from step to step. The
correction is a contact problem of displacements instead of velocities. With the displacements M⁻¹ H p of the bodies,
and w = W p those of the contacts,

    0 ≤ w_N + g + a ⊥ p_N ≥ 0,   ‖p_T‖ ≤ μ p_N,   and p_T opposes w_T, at the limit, while sliding

by sweeps until no overlap -(g + w_N) is above its limit. Deep piles sink in the same way from step to step, and sweeps
carry a lift up slowly, so p begins near that of the last correction. Velocities and impulses take no part, so no
kinetic energy comes of it; disks that are lifted gain potential energy, which is accounted for.
"""

from dataclasses import dataclass, replace

import numpy as np

from ground.errors import SceneError
from mechanics.arrays import Array, Ints
from mechanics.carried import Carrier
from mechanics.planar.contacts import PlanarContacts
from mechanics.planar.delassus import PlanarDelassus
from mechanics.planar.model import PlanarModel, PlanarState
from mechanics.scene.laws.law import Terms

# overlap over the largest allowed that a correction leaves, a in the equations: contacts stay closed [-]
_REMAINING_OVERLAP = 0.5
# overlap beyond that from which disks are moved apart, over the largest allowed; the rest is for what is not linear
_BEYOND = 0.3
# of overlaps at the start that are just as large as allowed [-]
_OVERLAP_ROUNDING = 1e-9
# part of the last correction from which the next one begins: what is no longer needed fades, and what is needed has to
# be found again by sweeps, slowly [-]
_AGAIN = 0.97
# sweeps between two looks
_LOOK = 10
# sweeps of one correction at most; what is left then is left to the next step
_SWEEPS = 5000


def refuse_deep(model: PlanarModel, contacts: PlanarContacts) -> None:
    """Refuse a start at which disks overlap by more than `PlanarScene.start_overlap`, or a wall runs through them.

    Raises
    ------
    SceneError : naming the two bodies that overlap most, the place, and how many more there are
    """
    scene, radius = model.scene, 0.5 * contacts.size
    ratio = -contacts.gap / radius
    deep = np.flatnonzero(ratio > scene.start_overlap * (1.0 + _OVERLAP_ROUNDING))
    if not len(deep):
        return
    worst = deep[np.argmax(ratio[deep])]
    codes, (first, second) = scene.codes, contacts.bodies[worst].tolist()
    across = second >= len(model.radius)
    x, y = contacts.point[worst]
    more = f"; so do {len(deep) - 1} more pairs" if len(deep) > 1 else ""
    raise SceneError(
        f"at the start they overlap by {-contacts.gap[worst]:.4g} m at ({x:.6g}, {y:.6g}), {ratio[worst]:.0%} of the "
        f"radius {radius[worst]:.4g} m; {scene.start_overlap:.0%} is allowed{more}",
        where=f"disk {codes[first]!r} and {'wall' if across else 'disk'} {codes[second]!r}",
        remedy="move the wall or the disk" if across else "move them apart, or leave one out",
    )


@dataclass(frozen=True)
class Apart:
    """Places at the end of a step.

    Attributes
    ----------
    state : of the bodies; a correction leaves its velocities as they are
    gap : (nc,) of the step's contacts [m]
    moved : (nb, 3) displacements [m] and turns [rad] of the correction; None without one
    """

    state: PlanarState
    gap: Array
    moved: Array | None = None


class Overlaps(Carrier):
    """Overlaps of a run, and their correction.

    Overlaps of the start are those of the scene, and may stay.

    Parameters
    ----------
    allowed : largest overlap [m]; infinite: none is corrected
    """

    CARRIED = ("_gap", "_key", "_push", "_pushed")
    REBUILT = ("_allowed",)

    def __init__(self, allowed: float) -> None:
        self._allowed = allowed
        self._key: Ints = np.zeros(0, dtype=np.int64)
        self._gap: Array = np.zeros(0)
        self._pushed: Ints = np.zeros(0, dtype=np.int64)
        self._push: Array = np.zeros((0, 2))

    def begin(self, contacts: PlanarContacts) -> None:
        """Take up the overlaps of the start."""
        deep = np.flatnonzero(contacts.gap < 0)
        deep = deep[np.argsort(contacts.key[deep], kind="stable")]
        self._key, self._gap = contacts.key[deep], contacts.gap[deep]

    def __call__(
        self,
        contacts: PlanarContacts,
        operator: PlanarDelassus,
        terms: Terms,
        end: Apart,
        step: float,
    ) -> Apart:
        """Move disks apart where their overlap is too large at the end of a step.

        Overlaps that a rebound undoes within another step are left to it.

        Parameters
        ----------
        contacts, operator : of the step
        terms : their laws; contacts that do not act in the step, as before a rebound, may overlap
        end : of the step
        step : h [s]
        """
        gap, state = end.gap, end.state
        if not (-gap).max(initial=0.0) > (_REMAINING_OVERLAP + _BEYOND) * self._allowed:
            return end
        of_start = _recalled(self._key, self._gap, contacts.key)
        remaining = np.minimum(of_start, -_REMAINING_OVERLAP * self._allowed)
        limit = remaining - _BEYOND * self._allowed
        opening = np.maximum(operator.relative_velocity(state.velocity)[:, 0], 0.0)
        ahead = np.where(terms.bias < 0, gap + step * opening, gap)
        ahead[~np.isfinite(terms.bias)] = np.inf
        if not (ahead < limit).any():
            return end
        shift, none = np.zeros((len(gap), 2)), np.zeros(len(gap))
        shift[:, 0] = ahead - remaining
        sweep = operator.gauss_seidel(shift, terms.friction, none)
        push = _AGAIN * _recalled(self._pushed, self._push, contacts.key)
        for _ in range(_SWEEPS // _LOOK):
            sweep(push, _LOOK)
            apart = operator.apply(push)[:, 0]
            if (ahead + apart >= limit).all():
                break
        order = np.argsort(contacts.key, kind="stable")
        self._pushed, self._push = contacts.key[order], push[order]
        moved = operator.velocity_change(push)
        place = replace(state, centre=state.centre + moved[:, :2], angle=state.angle + moved[:, 2])
        return Apart(place, gap + apart, moved)


def _recalled(stored: Ints, values: Array, key: Ints) -> Array:
    """Return the values of contacts by sorted keys; zero for those that are not known."""
    recalled = np.zeros((len(key), *values.shape[1:]))
    if len(stored):
        at = np.minimum(np.searchsorted(stored, key), len(stored) - 1)
        same = stored[at] == key
        recalled[same] = values[at[same]]
    return recalled
