"""Keys of a scene file that say of what stones are, and into what elements they are cut.

docs/scene.md is held to these lists by a test.
"""

from mechanics.scene.scene import Block
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.meshers.choice import Mesher
from pipelines.toml.schema import Key, Kind

__all__ = ["MATERIAL_KEYS", "MESH", "MESH_KEYS", "ORTHOTROPY_KEYS"]

MATERIAL_KEYS = (
    Key("density", Kind.NUMBER, "Density ρ.", "kg/m³", above=0),
    Key("young", Kind.NUMBER, "Young's modulus E; only deformable stones use it.", "Pa", above=0),
    Key("poisson", Kind.NUMBER, "Poisson's ratio ν.", "-", at_least=0, below=0.5),
    Key(
        "mass_damping",
        Kind.NUMBER,
        "α of Rayleigh's damping V = α M + β K of deformable stones; it also slows their motion as a whole.",
        "1/s",
        Material.mass_damping,
        at_least=0,
    ),
    Key(
        "stiffness_damping",
        Kind.NUMBER,
        "β of Rayleigh's damping; it slows their deformation alone.",
        "s",
        Material.stiffness_damping,
        at_least=0,
    ),
    Key("tensile_strength", Kind.NUMBER, "Tension that it bears; else no utilisation.", "Pa", None, above=0),
    Key(
        "compressive_strength",
        Kind.NUMBER,
        "Compression that it bears, positive; else no utilisation.",
        "Pa",
        None,
        above=0,
    ),
    Key(
        "stones",
        Kind.TEXTS,
        "Expressions; stones that satisfy any of them are of this material. "
        "One material may leave this out: it is that of all other stones.",
        default=(),
    ),
)

ORTHOTROPY_KEYS = (
    Key("young", Kind.VECTOR, "Young's moduli E₁, E₂, E₃ along three axes.", "Pa", above=0),
    Key("shear", Kind.VECTOR, "Shear moduli G₁₂, G₂₃, G₃₁.", "Pa", above=0),
    Key(
        "poisson", Kind.VECTOR, "Ratios ν₁₂, ν₂₃, ν₃₁; ν_ij: contraction along j under a stress along i.", "-"
    ),
    Key(
        "axes",
        Kind.ROWS,
        "The three axes, at right angles, as the scene begins; else x, y, z. Their lengths do not matter.",
        "-",
        None,
    ),
)

_ELEMENTS = tuple(one.value for one in Element)
_MESHERS = tuple(one.value for one in Mesher)

MESH = (
    Key("size", Kind.NUMBER, "Target edge length of the finite elements.", "m", 0.2, above=0),
    Key(
        "element",
        Kind.TEXT,
        "Their kind: tetrahedra (tet…) or hexahedra (hex…), of the first (tet4, hex8) or second order.",
        default=Block.element.value,
        choices=_ELEMENTS,
    ),
    Key(
        "contact_size",
        Kind.NUMBER,
        "Target edge length at faces that touch other stones; else `size`, which a larger one does not change.",
        "m",
        None,
        above=0,
    ),
    Key(
        "growth",
        Kind.NUMBER,
        "By how much edges get longer with the distance from these faces, until they reach `size`.",
        "-",
        Block.growth,
        above=0,
    ),
    Key(
        "mesher",
        Kind.TEXT,
        "Of tetrahedra: auto: delaunay for convex stones, gmsh for others; gmsh: first; delaunay: alone.",
        default=Block.mesher.value,
        choices=_MESHERS,
    ),
    Key(
        "ring_size",
        Kind.NUMBER,
        "Target edge length of stones that deform for the stress of others (`ring` in `[bodies]`); else twice `size`.",
        "m",
        None,
        above=0,
    ),
)

MESH_KEYS = (
    Key("stones", Kind.STONES, "Codes or expressions of the stones that are meshed otherwise."),
    Key("size", Kind.NUMBER, "Target edge length; else that of `[mesh]`.", "m", None, above=0),
    Key("element", Kind.TEXT, "Kind of element; else that of `[mesh]`.", default=None, choices=_ELEMENTS),
    Key("contact_size", Kind.NUMBER, "At faces in contact; else that of `[mesh]`.", "m", None, above=0),
    Key("growth", Kind.NUMBER, "Away from them; else that of `[mesh]`.", "-", None, above=0),
    Key("mesher", Kind.TEXT, "Of tetrahedra; else that of `[mesh]`.", default=None, choices=_MESHERS),
)
