"""Joints that are open at the start: which of them count as closed, as `moma check`, `run` and `assess` all say it."""

from dataclasses import dataclass, replace

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.contact.contacts import gaps
from mechanics.dynamics.contact_search import CLOSED, detector, slits
from mechanics.model.model import Model, build_model
from mechanics.scene.loads.load import Loads
from mechanics.scene.scene import Fidelity, Scene
from mechanics.scene.state import State

__all__ = ["OpenJoints", "open_joints", "rigid_model"]

_NAMED = 4  # most joints that are named
_SEEN = 1e-6  # gap that is told [m]


@dataclass(frozen=True)
class OpenJoints:
    """Pairs of stones that are near each other at the start, and the gaps between them.

    A joint is as wide as the narrowest gap of its contact points, and closed up to a gap of a thousandth of the smaller
    stone's width.

    Attributes
    ----------
    stones : (nj, 2) their codes
    gap : (nj,) between them; negative: they overlap [m]
    closed : (nj,) they count as closed
    """

    stones: tuple[tuple[str, str], ...]
    gap: Array
    closed: "np.ndarray[tuple[int], np.dtype[np.bool_]]"

    def in_words(self) -> tuple[str, ...]:
        """Return how many joints are closed by the rule alone, and how many are open; nothing where no joint gapes."""
        gapes = self.gap > _SEEN
        ruled, left = np.flatnonzero(gapes & self.closed), np.flatnonzero(gapes & ~self.closed)
        rule, total = f"{CLOSED:g} of the smaller stone's width", len(self.gap)
        said = []
        if len(ruled):
            said.append(
                f"gaps of up to {rule} count as closed: {len(ruled)} of {total} joints have one ({self._named(ruled)})"
            )
        if len(left):
            said.append(
                f"{len(left)} of {total} joints gape wider than {rule}, and bear nothing until stones have moved "
                f"({self._named(left)})"
            )
        return tuple(said)

    def _named(self, joints: Ints) -> str:
        widest = joints[np.argsort(-self.gap[joints], kind="stable")][:_NAMED]
        shown = [f"{' – '.join(self.stones[one])} {1e3 * self.gap[one]:.2g} mm" for one in widest.tolist()]
        return ", ".join(shown) + (", …" if len(joints) > _NAMED else "")


def rigid_model(scene: Scene) -> tuple[Model, State]:
    """Return the stones of a scene at its start, all rigid: where they touch does not depend on meshes or loads."""
    blocks = tuple(
        replace(one, fidelity=Fidelity.RIGID) if one.fidelity is Fidelity.DEFORMABLE else one
        for one in scene.blocks
    )
    return build_model(replace(scene, blocks=blocks, loads=Loads()))


def open_joints(model: Model, start: State) -> OpenJoints:
    """Return the pairs of stones that are watched at the start, those between fixed ones left out."""
    contacts = detector(model)(start, np.zeros(len(model.mass)))
    gap = gaps(contacts, start)
    pairs, joint = np.unique(np.sort(contacts.bodies, axis=1), axis=0, return_inverse=True)
    narrowest = np.full(len(pairs), np.inf)
    np.minimum.at(narrowest, joint.ravel(), gap)
    closed = np.zeros(len(pairs), dtype=bool)
    closed[joint.ravel()[gap <= slits(model, contacts)]] = True
    codes = [block.code for block in model.scene.blocks]
    return OpenJoints(tuple((codes[a], codes[b]) for a, b in pairs.tolist()), narrowest, closed)
