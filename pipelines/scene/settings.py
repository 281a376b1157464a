"""Values of the tables of a scene file that no other package has a type for."""

from dataclasses import dataclass

from mechanics.scene.scene import Block, Fidelity
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.meshers.choice import Mesher

__all__ = ["Fidelities", "MaterialRule", "MeshSettings", "Output", "Selection"]

_COARSER = 2.0
"""Edges of the ring over those of the stones for whose sake it deforms: docs/accuracy.md, section 13."""


@dataclass(frozen=True)
class Selection:
    """Which stones take part: of this kind, satisfying all of `where`, named by none of `exclude`."""

    kind: str
    where: tuple[str, ...]
    exclude: tuple[str, ...]


@dataclass(frozen=True)
class MaterialRule:
    """A material and the expressions of its stones; no expressions: all stones that no other rule names."""

    material: Material
    stones: tuple[str, ...]


@dataclass(frozen=True)
class Fidelities:
    """How stones are modelled: `fixed` goes before the other lists.

    Attributes
    ----------
    default : of stones in no list; None: as their outputs need it
    rigid, deformable, fixed : codes or expressions
    ring : without a default, stones within so many joints of one whose stress is asked for deform too
    """

    default: Fidelity | None
    rigid: tuple[str, ...]
    deformable: tuple[str, ...]
    fixed: tuple[str, ...]
    ring: int


@dataclass(frozen=True)
class MeshSettings:
    """Finite elements of deformable stones.

    Attributes
    ----------
    size : target edge length [m]
    element : kind
    contact_size : target edge length at faces that touch other stones; None: as everywhere [m]
    growth : by how much edges get longer per metre away from these faces [-]
    mesher : of tetrahedra
    ring_size : target edge length of stones that deform for the stress of others; None: twice `size` [m]
    """

    size: float
    element: Element
    contact_size: float | None = None
    growth: float = Block.growth
    mesher: Mesher = Block.mesher
    ring_size: float | None = None

    def size_of(self, ring: int) -> float:
        """Target edge length of a stone that is so many joints from those whose stress is wanted [m]."""
        if ring == 0:
            return self.size
        return _COARSER * self.size if self.ring_size is None else self.ring_size


@dataclass(frozen=True)
class Output:
    """What to keep.

    Attributes
    ----------
    frame_every : a frame every so many steps; 0: first and last
    stress : codes or expressions of the stones whose stress is wanted; None: of all that deform
    pictures : their names; None: the usual
    """

    frame_every: int
    stress: tuple[str, ...] | None
    pictures: tuple[str, ...] | None
