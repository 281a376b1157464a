"""One elastic stone: finite elements in axes that move with it (co-rotation).

The motion of a stone is that of its axes, a rigid one, and a displacement d of its nodes in them that has no part in
any rigid motion (Rᵀ M d = 0, with R the six rigid modes: Tisserand's mean axes). In body axes the θ-scheme reads

    v_new = v + ŵ [ -h V v - h K (d + h θ v) + h P + H r ],     ŵ = (M + h θ V + h² θ² K)⁻¹

with d and v at the start of the step (docs/theory.md §2). Only matrices of the undeformed stone are needed, so ŵ is
factorised once, and a stone may turn as far as it likes while its strain stays small. Equal stones share one
`Deformable`.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import splu

from mechanics.arrays import Array, Ints
from mechanics.stones.elasticity.operators import ElasticOperators, elastic_operators
from mechanics.stones.elasticity.recovery import recovery
from mechanics.stones.elasticity.stress import sampled_stress
from mechanics.stones.elasticity.tensors import from_voigt, to_voigt
from mechanics.stones.materials import Material
from mechanics.stones.meshing.mesh import SolidMesh

_LEAF = 40  # nodes of a part that is not divided further


_LARGE = 1500  # nodes above which nested dissection gives less fill-in than minimum degree


@dataclass(frozen=True)
class Deformable:
    """An elastic stone.

    Attributes
    ----------
    mesh : nodes relative to the centre of mass
    material : density, elasticity and damping
    operators : M and K
    damping : V = α M + β K [kg/s]
    weight : (n,) M times a unit acceleration: the nodal weights of a uniform one [kg]
    modes : R (3n, 6), nodal velocities of unit translations and of unit rotations
    projector : (6, 3n) (Rᵀ M R)⁻¹ Rᵀ M, the rigid motion in nodal velocities
    inertia : (3, 3) about the centre of mass, body axes [kg m²]
    """

    mesh: SolidMesh
    material: Material
    operators: ElasticOperators
    damping: "csc_array[np.float64]"
    weight: Array
    modes: Array
    projector: Array
    inertia: Array

    @property
    def mass(self) -> float:
        """[kg]."""
        return float(self.weight.sum())

    def stress(self, node: Array, centre: Array, rotation: Array) -> Array:
        """Return the recovered nodal stress (n, 6) in world axes [Pa]."""
        local = self.recovered(self.displacement(node, centre, rotation))
        return to_voigt(rotation @ from_voigt(local) @ rotation.T)

    def recovered(self, displacement: Array) -> Array:
        """Return the recovered nodal stress (n, 6), body axes [Pa], from displacements (n, 3) in them [m]."""
        local: Array = self._recovery @ sampled_stress(self.mesh, self.material, displacement)
        return local

    @cached_property
    def _recovery(self) -> "csr_array[np.float64]":
        return recovery(self.mesh)

    def displacement(self, node: Array, centre: Array, rotation: Array) -> Array:
        """Return the displacement d of the nodes (n, 3) from the undeformed stone, body axes [m]."""
        return (node - centre) @ rotation - self.mesh.nodes

    def elastic_energy(self, node: Array, centre: Array, rotation: Array) -> float:
        """Return ½ dᵀ K d [J]."""
        d = self.displacement(node, centre, rotation).ravel()
        return float(0.5 * d @ (self.operators.stiffness @ d))


def deformable(mesh: SolidMesh, material: Material, lumped: bool = False) -> tuple[Deformable, Array]:
    """Return the elastic stone of a mesh, and its centre of mass (3,) [m]."""
    operators = elastic_operators(mesh, material, lumped)
    weight = np.asarray(operators.mass.sum(axis=1)).reshape(-1, 3)[:, 0]
    centre = weight @ mesh.nodes / weight.sum()
    local = replace(mesh, nodes=mesh.nodes - centre)
    modes = _rigid_modes(local.nodes)
    momentum = np.ascontiguousarray((operators.mass @ modes).T)
    inertia = momentum @ modes
    damping = material.mass_damping * operators.mass + material.stiffness_damping * operators.stiffness
    stone = Deformable(
        local,
        material,
        operators,
        csc_array(damping),
        weight,
        modes,
        np.linalg.solve(inertia, momentum),
        inertia[3:, 3:],
    )
    return stone, centre


def _rigid_modes(nodes: Array) -> Array:
    """Return R (3n, 6): nodal velocities of three unit translations and of unit rotations about three axes."""
    modes = np.zeros((len(nodes), 3, 6))
    modes[:, :, :3] = np.eye(3)
    for axis in range(3):
        modes[:, :, 3 + axis] = np.cross(np.eye(3)[axis], nodes)
    return modes.reshape(-1, 6)


class Compliance:
    """ŵ = (M + h θ V + h² θ² K)⁻¹ of one stone, for one time step and θ.

    ŵ moves the stone as a whole, through its mass, and deforms it. In long steps the first part is larger by many
    orders, and its rounding would exceed the second; the two are kept apart, and momentum is exact.

    Parameters
    ----------
    stone : the stone
    step, theta : h [s] and θ
    """

    def __init__(self, stone: Deformable, step: float, theta: float) -> None:
        operators, h = stone.operators, step * theta
        self._stone, self._duration = stone, h
        large = len(stone.mesh.nodes) > _LARGE
        self._order = _dofs(dissection(stone.mesh) if large else np.arange(len(stone.mesh.nodes)))
        self._factor = splu(
            csc_array(self.matrix[self._order][:, self._order]),
            permc_spec="NATURAL" if large else "MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        self._modes, self._projector = stone.modes, stone.projector
        momentum = operators.mass @ stone.modes
        # V acts on rigid motion by its part α M alone
        self._whole = np.linalg.inv(stone.modes.T @ momentum) / self.drag
        self._nodes = self._batch = np.zeros(0, dtype=np.int64)
        self._condensed = np.zeros((0, 0))

    @property
    def drag(self) -> float:
        """1 + h θ α, by which ŵ moves the stone as a whole less than without damping [-]."""
        return 1.0 + self._duration * self._stone.material.mass_damping

    @property
    def matrix(self) -> "csc_array[np.float64]":
        """ŵ⁻¹ (3n, 3n), body axes, assembled at each access [kg]."""
        stone, h = self._stone, self._duration
        return csc_array(stone.operators.mass + h * stone.damping + h**2 * stone.operators.stiffness)

    def respond(self, impulse: Array) -> Array:
        """Return the velocities ŵ p (…, n, 3) due to nodal impulses p (…, n, 3) [N s], body axes [m/s]."""
        return self.deform(impulse) + self.shift(impulse)

    def deform(self, impulse: Array) -> Array:
        """Return the part of ŵ p that deforms the stone."""
        columns = impulse.reshape(-1, len(self._modes)).T
        velocity: Array = self._deforming(columns).T.reshape(impulse.shape)
        return velocity

    def shift(self, impulse: Array) -> Array:
        """Return the part of ŵ p that moves the stone as a whole."""
        columns = impulse.reshape(-1, len(self._modes)).T
        velocity: Array = (self._modes @ (self._whole @ (self._modes.T @ columns))).T.reshape(impulse.shape)
        return velocity

    def _deforming(self, columns: Array) -> Array:
        deforming = columns - self._projector.T @ (self._modes.T @ columns)
        velocity = np.empty_like(deforming)
        velocity[self._order] = self._factor.solve(deforming[self._order])
        velocity -= self._modes @ (self._projector @ velocity)
        return velocity

    def between(self, nodes: Ints) -> Array:
        """Return C = S ŵ Sᵀ (3k, 3k) between k nodes, in ascending order [1/kg].

        Condensed nodes are kept, as the same faces touch in many steps.
        """
        new = np.setdiff1d(nodes, self._nodes)
        if len(new):
            self._condense(new)
        if len(nodes) == len(self._nodes):
            return self._condensed
        places = _dofs(np.searchsorted(self._nodes, nodes))
        return self._condensed[np.ix_(places, places)]

    @property
    def condensed(self) -> Ints:
        """(k, 2) condensed nodes, ascending, and the call that condensed each: the order decides on the last bits."""
        return np.column_stack([self._nodes, self._batch])

    def condense_again(self, condensed: Ints) -> None:
        """Condense the nodes of another compliance of the same stone, in the same order."""
        for batch in range(int(condensed[:, 1].max(initial=-1)) + 1):
            self._condense(condensed[condensed[:, 1] == batch, 0])

    def _condense(self, new: Ints) -> None:
        """Add the rows and columns of new nodes."""
        nodes = np.union1d(self._nodes, new)
        batch = np.full(len(nodes), self._batch.max(initial=-1) + 1)
        batch[np.searchsorted(nodes, self._nodes)] = self._batch
        dofs, added = _dofs(nodes), _dofs(new)
        unit = np.zeros((len(self._modes), len(added)))
        unit[added, np.arange(len(added))] = 1.0
        columns = self._deforming(unit)[dofs] + self._modes[dofs] @ self._whole @ self._modes[added].T
        old, new_dofs = (np.searchsorted(dofs, _dofs(part)) for part in (self._nodes, new))
        square = np.empty((len(dofs), len(dofs)))
        square[np.ix_(old, old)] = self._condensed
        square[:, new_dofs] = columns
        square[np.ix_(new_dofs, old)] = columns[old].T
        square[np.ix_(new_dofs, new_dofs)] = 0.5 * (columns[new_dofs] + columns[new_dofs].T)
        self._nodes, self._batch, self._condensed = nodes, batch, square


def _dofs(nodes: Ints) -> Ints:
    dofs: Ints = (3 * nodes[:, None] + np.arange(3)).ravel()
    return dofs


def dissection(mesh: SolidMesh) -> Ints:
    """Return the order (n,) of the nodes: the two halves of the stone, then the nodes between them; so in each half.

    No matrix entry links one half to the other, so factors fill in far less than by minimum degree: of
    11,000 nodes they take 16 million numbers and 20 s instead of 20 million and 132 s.
    """
    nodes, cell = len(mesh.nodes), mesh.cells
    pairs = np.repeat(cell, cell.shape[1], axis=1).ravel(), np.tile(cell, (1, cell.shape[1])).ravel()
    adjacent = csr_array((np.ones(len(pairs[0]), dtype=np.int32), pairs), shape=(nodes, nodes))
    order: Ints = np.concatenate(_parts(mesh.nodes, adjacent, np.arange(nodes)))
    return order


def _parts(place: Array, adjacent: "csr_array[np.int32]", nodes: Ints) -> list[Ints]:
    if len(nodes) <= _LEAF:
        return [nodes]
    along = place[nodes, int(np.ptp(place[nodes], axis=0).argmax())]
    low = along < np.median(along)
    if not low.any():
        return [nodes]
    inside = np.zeros(len(place), dtype=np.int32)
    inside[nodes[low]] = 1
    high = nodes[~low]
    between = adjacent[high] @ inside > 0
    parts = _parts(place, adjacent, nodes[low]) + _parts(place, adjacent, high[~between])
    return [*parts, high[between]]
