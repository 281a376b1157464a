"""Settings of a scene file that no other package has a type for."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

from ground.settings import Setting
from mechanics.scene.scene import Block, ContactSize, Fidelity, Growth
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.meshers.choice import Mesher

_COARSER = 2.0
"""Edges of the ring over those of the stones for whose sake it deforms: docs/accuracy.md, section 13."""

Texts = tuple[str, ...]


@dataclass(frozen=True)
class Selection:
    """Stones that take part: of this kind, satisfying all of `where`, named by none of `exclude`."""

    kind: Annotated[str, Setting("Kind of the stones; its subkinds belong to it.")] = "entity"
    where: Annotated[Texts, Setting("Expressions that every stone must satisfy.")] = ()
    exclude: Annotated[Texts, Setting("Codes or expressions; stones named by any of them are left out.")] = ()


@dataclass(frozen=True)
class MaterialRule:
    """A material and the expressions of its stones; no expressions: all stones that no other rule names."""

    material: Material
    stones: Annotated[
        Texts,
        Setting(
            "Expressions; stones that satisfy any of them are of this material. "
            "One material may leave this out: it is that of all other stones."
        ),
    ] = ()


@dataclass(frozen=True)
class Fidelities:
    """Models of the stones: `fixed` takes precedence over the other lists.

    Attributes
    ----------
    default : None, which is "auto" in the file: as their outputs need it
    """

    default: Annotated[
        Fidelity | None,
        Setting("Model of stones that no list below names; auto: rigid unless an output needs their stress."),
    ] = None
    rigid: Annotated[Texts, Setting("Codes or expressions of stones that move but do not deform.")] = ()
    deformable: Annotated[Texts, Setting("Codes or expressions of stones with finite elements.")] = ()
    fixed: Annotated[Texts, Setting("Codes or expressions of stones that never move: the supports.")] = ()
    ring: Annotated[
        int,
        Setting(
            "With auto, stones within this many joints of one named by `stress` in `[output]` deform too.",
            at_least=0,
        ),
    ] = 3


@dataclass(frozen=True)
class MeshSettings:
    """Finite elements of deformable stones."""

    size: Annotated[float, Setting("Target edge length of the finite elements.", "m", above=0)] = 0.2
    element: Annotated[
        Element,
        Setting(
            "Element type: tetrahedra (tet…) or hexahedra (hex…), of the first (tet4, hex8) or second order."
        ),
    ] = Block.element
    contact_size: ContactSize = None
    growth: Growth = Block.growth
    mesher: Annotated[
        Mesher,
        Setting(
            "Mesher of tetrahedra: auto: delaunay for convex stones, gmsh for others; gmsh: first; delaunay: alone."
        ),
    ] = Block.mesher
    ring_size: Annotated[
        float | None,
        Setting(
            "Target edge length of stones that deform for the stress of others (`ring` in `[bodies]`); "
            "if not given, twice `size`.",
            "m",
            above=0,
        ),
    ] = None

    def size_of(self, ring: int) -> float:
        """Return the target edge length of a stone that is `ring` joints from those whose stress is wanted [m]."""
        if ring == 0:
            return self.size
        return _COARSER * self.size if self.ring_size is None else self.ring_size


class ParaView(StrEnum):
    """Files for ParaView."""

    VTKHDF = "vtkhdf"
    PVD = "pvd"
    BOTH = "both"


@dataclass(frozen=True)
class Output:
    """Results to keep."""

    frame_every: Annotated[
        int,
        Setting(
            "Number of steps between frames of motion, stresses and contacts; 0: first and last frame only.",
            at_least=0,
        ),
    ] = 0
    stress: Annotated[
        Texts | None,
        Setting("Codes or expressions of the stones whose stress is wanted; if not given, all that deform."),
    ] = None
    pictures: Annotated[
        Texts | None,
        Setting(
            "Pictures to draw, see below; if not given, displacement, and von_mises where a stone deforms."
        ),
    ] = None
    paraview: Annotated[
        ParaView,
        Setting(
            "Files for ParaView: vtkhdf: one, which grows as the run goes on; pvd: a file a frame, at the end; both."
        ),
    ] = ParaView.VTKHDF
    checkpoint: Annotated[
        int,
        Setting(
            "Number of steps between checkpoints, from which `moma run --resume` goes on; 0: only where Ctrl-C stops.",
            at_least=0,
        ),
    ] = 100
    series: Annotated[
        Texts,
        Setting(
            "Codes or expressions of the stones whose motion is written in every step, with the joints between them."
        ),
    ] = ()
