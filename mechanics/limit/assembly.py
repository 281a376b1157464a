"""Equilibrium of rigid stones on the contact points that the detection finds.

Every joint acts in its contact points, the corners of the common face, with a force f = (f_N, f_T1, f_T2) on the
candidate of each. All stones that are free to move are in balance under a load p if

    H f + p = 0,     ‖f_T‖ ≤ μ (f_N + s) + k,   f_N + s ≥ 0

with friction μ, cohesion k and tensile strength s of each point (mechanics.scene.laws, docs/theory.md §2). Joints of
stones whose compressive strength is known may also crush (`mechanics.limit.joints`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property

import numpy as np
from scipy.sparse import csc_array, csr_array

from ground.errors import SceneError
from mechanics.arrays import Array, Ints
from mechanics.contact.contacts import Contacts, gaps, take
from mechanics.contact.shared_area import SLACK
from mechanics.delassus.rigid import RigidDelassus
from mechanics.dynamics.contact_search import contacts_as_drawn, detection
from mechanics.limit.joints import Joints, StressBlocks, find_joints, stress_blocks
from mechanics.model.model import Model, build_model
from mechanics.problem.forms import SparseForm
from mechanics.scene.laws.law import STATE, Approach
from mechanics.scene.laws.table import LawTable
from mechanics.scene.scene import Scene
from mechanics.scene.state import State

CLOSED = SLACK  # gap up to which a joint counts as closed, over the width of the smaller stone [-]


@dataclass(frozen=True)
class Strength:
    """Strength of contact points.

    Attributes
    ----------
    friction : (nc,) μ [-]
    cohesion, tension : (nc,) k and s [N]
    """

    friction: Array
    cohesion: Array
    tension: Array

    def shear(self, force: Array) -> Array:
        """Return the shear (nc,) that contacts with forces (nc, 3) can carry [N]."""
        carried: Array = self.friction * (force[:, 0] + self.tension) + self.cohesion
        return carried


@dataclass(frozen=True)
class RigidAssembly:
    """Rigid stones and the joints that are closed.

    Attributes
    ----------
    model, state : the stones, all rigid or fixed
    contacts : the contact points (nc) of closed joints
    free : (n,) bodies that may move
    operator : W of the contact points
    lift : (6 n, 3 nc) H, forces at contacts → force [N] and moment about its centre [N m] of each free stone
    dead : (6 n,) weight, and the forces of the scene at its start [N, N m]
    strength : of the contact points
    crushing : limits of crushing; None where no stone states its compressive strength
    widest : largest gap that counts as closed [m]
    """

    model: Model
    state: State
    contacts: Contacts
    free: Ints
    operator: RigidDelassus
    lift: "csc_array[np.float64]"
    dead: Array
    strength: Strength
    crushing: StressBlocks | None
    widest: float

    @cached_property
    def joints(self) -> Joints:
        """Joints in which the contact points act together; a tenth of the time of an assembly, so on demand."""
        return find_joints(self.model, self.state, self.contacts)

    @property
    def weight(self) -> float:
        """Weight of all stones that may move [N]."""
        gravity = float(np.linalg.norm(self.model.gravity(0.0)))
        return float(self.model.mass[self.free].sum()) * gravity

    def push(self, bodies: Ints) -> "csr_array[np.float64]":
        """Return the matrix (3, 3 nc) of the force with which contacts push fixed bodies as a whole."""
        side = np.isin(self.contacts.bodies, bodies)
        # the force acts on the candidate, its opposite on the antagonist
        sign = side[:, 0].astype(float) - side[:, 1]
        columns = sign[:, None, None] * self.contacts.frame
        return csr_array(columns.reshape(-1, 3).T)

    def rows(self, codes: Sequence[str], where: str) -> Ints:
        """Return the bodies with these codes, in order.

        Raises
        ------
        SceneError : there is no such stone
        """
        body_of = {block.code: body for body, block in enumerate(self.model.scene.blocks)}
        for code in codes:
            if code not in body_of:
                similar = get_close_matches(code, body_of, n=3, cutoff=0.4) or sorted(body_of)[:3]
                raise SceneError(
                    f"no such stone: {code!r}",
                    where=where,
                    remedy=f"give the codes of stones of the scene, as {', '.join(similar)}",
                )
        return np.array(sorted(body_of[code] for code in codes), dtype=np.int64)


def assembly(scene: Scene, widest: float = CLOSED) -> RigidAssembly:
    """Return the equilibrium of a scene as it stands at its start; deformable stones count as rigid.

    Joints count as closed up to a `widest` gap, over the width of the smaller stone [-].

    Raises
    ------
    SceneError : no stone may move, or no joint is closed
    """
    scene = scene.rigid
    model, state = build_model(scene)
    free = np.flatnonzero(~model.fixed)
    if not len(free):
        raise SceneError("no stone may move", where=scene.name, remedy="fix the supports only")
    contacts = contacts_as_drawn(model, state)
    gap = gaps(contacts, state)
    size = np.minimum(*model.surfaces.size[contacts.bodies.T])
    closed = np.flatnonzero(gap <= widest * size)
    if not len(closed):
        raise SceneError(
            "no joint is closed",
            where=scene.name,
            remedy=f"close the joints: gaps up to {widest:g} of a stone's width count as closed",
        )
    detected = detection(model, state, take(contacts, closed), ())
    assert isinstance(detected.operator, RigidDelassus)
    form = detected.operator.form
    assert isinstance(form, SparseForm)
    stated = [block.material.compressive_strength for block in scene.blocks]
    strengths = np.array([np.inf if strength is None else strength for strength in stated])
    crushes = bool(np.isfinite(strengths).any())
    return RigidAssembly(
        model=model,
        state=state,
        contacts=detected.contacts,
        free=free,
        operator=detected.operator,
        lift=form.lift,
        dead=_dead(model, state, free),
        strength=joint_strength(model, detected.contacts, model.laws),
        crushing=stress_blocks(find_joints(model, state, detected.contacts), strengths) if crushes else None,
        widest=float(gap[closed].max()),
    )


def joint_strength(model: Model, contacts: Contacts, laws: LawTable) -> Strength:
    """Return the strength of closed joints, as laws state it for a step of one second: N for N s."""
    none = np.zeros(len(contacts))
    approach = Approach(
        gap=none,
        speed=none,
        slide=np.zeros((len(contacts), 2)),
        area=contacts.area,
        size=np.minimum(*model.surfaces.size[contacts.bodies.T]),
        compliance=none + 1.0,
        step=1.0,
        theta=1.0,
        push_out=False,
        pair=np.arange(len(contacts)),
        first=np.ones(len(contacts), dtype=bool),
        state=np.zeros((len(contacts), STATE)),
    )
    terms = laws.terms(laws.of(contacts.bodies), approach)
    return Strength(terms.friction, terms.cohesion, terms.adhesion)


def _dead(model: Model, state: State, free: Ints) -> Array:
    load = np.zeros((len(model.mass), 6))
    load[:, :3] = model.mass[:, None] * model.gravity(0.0)
    for force, bodies in model.forces:
        push, moment = force(0.0, state.centre[bodies], state.rotation[bodies])
        load[bodies, :3] += push
        load[bodies, 3:] += moment
    return load[free].ravel()
