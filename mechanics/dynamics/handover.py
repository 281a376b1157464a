"""Hand-over from one stage of building to the next: places of the stones, and forces of the contacts that persist."""

from dataclasses import dataclass, replace

import numpy as np

from mechanics.arrays import Array, Bools, Ints
from mechanics.contact.contacts import NODE, PAIR_BIT
from mechanics.dynamics.observers.equilibrium import displacement
from mechanics.dynamics.warm_start import Memory
from mechanics.model.model import Model
from mechanics.scene.state import State

_LOW = (1 << PAIR_BIT) - 1  # bits of a contact's key below those of its pair of shapes


@dataclass(frozen=True)
class Beginning:
    """State in which a run, or a stage of building, begins.

    Attributes
    ----------
    state : places and velocities
    drawn : the stones where the scene gives them
    standing : (nb,) stones of the stage before; the others are laid now
    held : (nb,) standing stones that could not move then, so that no contact between two of them was known
    memory : forces and internal variables of the contacts that persist; None: there are none
    """

    state: State
    drawn: State
    standing: Bools
    held: Bools
    memory: Memory | None = None

    def meets(self, bodies: Ints) -> Bools:
        """Return the contacts (nc,) between bodies (nc, 2) that were not possible before."""
        first, second = bodies[:, 0], bodies[:, 1]
        knew = self.standing[first] & self.standing[second] & ~(self.held[first] & self.held[second])
        met: Bools = ~knew
        return met

    def closed(self, initial: Array, drawn: Array) -> Array:
        """Return the part of each gap (nc,) that counts as closed, from those at the beginning and as drawn [m].

        Overlaps of survey and rounding are properties of a joint. A stone that is laid on others which have moved is
        laid where it was drawn: mortar fills what they have left open, and what they have taken of its place is cut off
        it. What the drawing itself leaves open stays open.
        """
        return np.where(initial < 0.0, initial, np.maximum(initial - np.maximum(drawn, 0.0), 0.0))

    def bed(self, model: Model) -> float:
        """Return the largest gap that mortar may have to fill: how far standing stones have moved [m]."""
        moved = displacement(model, self.drawn, self.state)
        return float(moved[self.standing].max(initial=0.0))


def of_run(start: State) -> Beginning:
    """Return the beginning of a run in which all stones stand where they were drawn."""
    none = np.zeros(len(start.centre), dtype=bool)
    return Beginning(start, start, none, none)


@dataclass(frozen=True)
class Handover:
    """End of a stage.

    Attributes
    ----------
    model : its stones
    drawn : the stones where the scene gives them
    state : where they came to rest
    memory : of its contacts
    """

    model: Model
    drawn: State
    state: State
    memory: Memory

    def to(self, model: Model, drawn: State) -> Beginning:
        """Return the beginning of the next stage; stones are the same by their code, and begin at rest.

        Forces of the contacts of stones that are taken away are forgotten, as those of stones that become supports
        with others.
        """
        old = _numbers(self.model, model)
        standing = old >= 0
        return Beginning(
            self._placed(model, drawn, old),
            drawn,
            standing,
            standing & self.model.fixed[old],
            self._remembered(model, old),
        )

    def _placed(self, model: Model, drawn: State, old: Ints) -> State:
        """Return the next state: standing stones where they are, others where they were drawn."""
        centre, rotation, node = drawn.centre.copy(), drawn.rotation.copy(), drawn.node.copy()
        for body in np.flatnonzero(old >= 0).tolist():
            before, rows = int(old[body]), model.nodes_of(body)
            turn = self.state.rotation[before]
            # a stone that begins to deform may have its centre of mass elsewhere, by the rounding of its mesh
            shift = drawn.centre[body] - self.drawn.centre[before]
            centre[body], rotation[body] = self.state.centre[before] + turn @ shift, turn
            if model.elastic[body] and self.model.elastic[before]:
                node[rows] = self.state.node[self.model.nodes_of(before)]
            elif model.elastic[body]:
                node[rows] = centre[body] + (drawn.node[rows] - drawn.centre[body]) @ turn.T
        still = np.zeros_like(drawn.velocity), np.zeros_like(drawn.node)
        return replace(
            drawn, centre=centre, rotation=rotation, node=node, velocity=still[0], node_velocity=still[1]
        )

    def _remembered(self, model: Model, old: Ints) -> Memory:
        new = np.full(len(self.model.mass), -1)
        new[old[old >= 0]] = np.flatnonzero(old >= 0)
        pace = model.scene.time.step / self.model.scene.time.step
        memory = self.memory.at_rest(pace).renamed(lambda key: _renamed(key, self.model, model, new))
        memory.follows = not model.scene.time.relaxation
        return memory


def _numbers(before: Model, after: Model) -> Ints:
    """Return the number of each body (nb,) in the model before; -1 where it is not there."""
    numbers = {block.code: number for number, block in enumerate(before.scene.blocks)}
    return np.array([numbers.get(block.code, -1) for block in after.scene.blocks], dtype=np.int64)


def _renamed(key: Ints, before: Model, after: Model, new: Ints) -> Ints:
    """Return the keys (nc,) of contacts in the next model, given the new numbers of bodies; -1: not there any more."""
    count, low = len(before.surfaces.body), key & _LOW
    pair = key >> PAIR_BIT
    first, second = (_shape(shape, before, after, new) for shape in (pair // count, pair % count))
    body, node = _node(np.where(low & NODE, low & (NODE - 1), 0), before, after, new)
    named = np.where(low & NODE, NODE + node, low)
    gone = (first < 0) | (second < 0) | ((low & NODE > 0) & (body < 0))
    renamed: Ints = np.where(gone, -1, ((first * len(after.surfaces.body) + second) << PAIR_BIT) + named)
    return renamed


def _shape(shape: Ints, before: Model, after: Model, new: Ints) -> Ints:
    """Return the new numbers of shapes; -1 for those of bodies that are gone."""
    surfaces_before, surfaces_after = before.surfaces, after.surfaces
    body = new[surfaces_before.body[shape]]
    numbers: Ints = np.where(
        body < 0, -1, surfaces_after.sptr[body] + shape - surfaces_before.sptr[surfaces_before.body[shape]]
    )
    return numbers


def _node(node: Ints, before: Model, after: Model, new: Ints) -> tuple[Ints, Ints]:
    """Return the new bodies of nodes, -1 where they deform no more, and the new numbers of the nodes."""
    start = before.elastic_stones.start
    if start[-1] == 0:
        return np.zeros_like(node), node
    was = np.searchsorted(start, node, side="right") - 1
    body = np.where(after.elastic[new[was]], new[was], -1)
    return body, after.elastic_stones.start[body] + node - start[was]
