"""Pairs of stones that touch without a common area, and the depth from which such a pair bears forces.

Where four stones of a bond or a dome meet in one line, the two diagonal pairs share an edge at most. Rounding decides
whether such a pair touches, overlaps or lies apart, and which of many directions its normal has. So it bears nothing
as it is drawn: its points act once its stones lie in each other by more than a *recess*, up to which a survey does not
say how they lie. A pair that comes to share an area, as a stone slides over the next one, bears from where it lies.

The common area is that of the overlap of two faces seen along their normal. A stone that stands on an edge within the
face of another has one, and so has a joint that has opened about its edge. Balls, and edges that cross, have a normal
of their own.
"""

from dataclasses import dataclass, replace

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.contact.contacts import PAIR_BIT, Contacts, gaps, material_points
from mechanics.contact.detection import FLAT, Detector
from mechanics.scene.scene import Placement
from mechanics.scene.state import State

SLACK = 1e-3
"""Error of a survey over the width of the smaller stone [-].

Joints open by less are closed, overlaps of faces that are narrower are none, and stones that share none may lie in each
other by as much.
"""

_WATCHED = 0.5  # share of its recess from which a pair has points, before they act [-]
_RISES = float(np.tan(np.arccos(FLAT)))  # slope within which faces lie flat on one another [-]


@dataclass(frozen=True)
class Recess:
    """Depth of pairs of shapes below which they bear no forces; other pairs have none.

    Attributes
    ----------
    pair : (np,) names of pairs, the high bits of the keys of their contacts, sorted
    depth : (np,) [m]
    """

    pair: Ints
    depth: Array

    def of(self, contacts: Contacts) -> Array:
        """Return the recess of each contact (nc,) [m]."""
        if not len(self.pair):
            return np.zeros(len(contacts))
        name = contacts.key >> PAIR_BIT
        at = np.minimum(np.searchsorted(self.pair, name), len(self.pair) - 1)
        recess: Array = np.where(self.pair[at] == name, self.depth[at], 0.0)
        return recess

    def after(self, contacts: Contacts, state: State, size: Array) -> "Recess":
        """Return the recess that is left with contacts as at a state; `size` (nb,) is the width of each body [m].

        Flat faces that have come to share an area bear from where they lie.
        """
        here = np.flatnonzero(self.of(contacts))
        if not len(here):
            return self
        pair, row, width, least = _overlaps(contacts, state, size, here)
        deepest = np.zeros(len(pair))
        np.maximum.at(deepest, row, -gaps(contacts, state)[here])
        # stones whose faces are not flat lie deeper in each other the farther they overlap
        shared = (width > least) & (deepest <= _RISES * width)
        at = np.searchsorted(self.pair, pair[shared])
        depth = self.depth.copy()
        depth[at] = np.minimum(depth[at], deepest[shared])
        recessed = depth > 0.0
        return Recess(self.pair[recessed], depth[recessed])

    def acting(self, contacts: Contacts, state: State, reach: Array) -> Ints:
        """Return the contacts (n,) that have no recess, or that come near it in a step with the `reach` (nb,) [m]."""
        recess = self.of(contacts)
        if not recess.any():
            return np.arange(len(contacts))
        approaching = gaps(contacts, state) <= reach[contacts.bodies].sum(axis=1) - _WATCHED * recess
        return np.flatnonzero(approaching | (recess == 0.0))


def recess_at(find: Detector, state: State) -> Recess:
    """Return the recess of the pairs that touch at a state, to the error of a survey, without a common area."""
    corners = replace(find, points=4, placement=Placement.CORNERS, spacing=None)
    search = replace(corners, alert=SLACK, distance=0.0)
    size = find.surfaces.size
    contacts = search(state, np.zeros(len(size)))
    pair, _, width, least = _overlaps(contacts, state, size, np.arange(len(contacts)))
    touching, bodies = search.face_pairs(state)
    without = np.flatnonzero(~np.isin(touching, pair[width > least]))
    order = without[np.argsort(touching[without])]
    return Recess(touching[order], SLACK * size[bodies[order]].min(axis=1, initial=np.inf))


def _overlaps(contacts: Contacts, state: State, size: Array, rows: Ints) -> tuple[Ints, Ints, Array, Array]:
    """Return the pairs (np,) of some contacts (n,), the pair of each, and the width of overlaps with the least [m].

    An overlap is as wide as its area over its longest extent.
    """
    bodies = contacts.bodies[rows]
    pair, first, row = np.unique(contacts.key[rows] >> PAIR_BIT, return_index=True, return_inverse=True)
    point = material_points(contacts, state)[rows].mean(axis=1)
    area: Array = np.bincount(row, contacts.area[rows], len(pair)).astype(float)
    extent = np.sqrt(area)
    np.maximum.at(extent, row, np.linalg.norm(point - point[first][row], axis=1))
    width = np.divide(area, extent, out=np.zeros_like(area), where=extent > 0.0)
    return pair, row, width, SLACK * size[bodies[first]].min(axis=1, initial=np.inf)
