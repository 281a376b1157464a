"""What `moma check` says of a scene."""

from collections.abc import Mapping
from dataclasses import dataclass

from pipelines.run.closing_check import JointsReport, SimplificationReport

__all__ = [
    "CheckReport",
    "Cost",
    "MaterialUse",
    "MeshQualityReport",
    "MeshUse",
    "StoneModelling",
]


@dataclass(frozen=True)
class MaterialUse:
    """A material and how many stones are of it."""

    name: str
    density: float
    young: float
    poisson: float
    stones: int


@dataclass(frozen=True)
class StoneModelling:
    """How one stone is modelled, why, and whether its stress is computed."""

    code: str
    fidelity: str
    reason: str
    stress: bool


@dataclass(frozen=True)
class MeshUse:
    """Finite elements of one kind and target edge length [m], and how many stones are of them."""

    element: str
    size: float
    stones: int


@dataclass(frozen=True)
class MeshQualityReport:
    """How the deformable stones were meshed.

    Attributes
    ----------
    nodes, cells : of all meshes
    distinct : meshes that had to be made; stones of one shape share theirs
    how : how many stones got their mesh from which mesher
    smallest_angle : between two sides of a cell [degrees], in the stone `sharpest`
    smallest_jacobian : of a cell, scaled [-], in the stone `worst`
    retried : stones at which a mesher failed before another succeeded, with the reasons
    """

    nodes: int
    cells: int
    distinct: int
    how: Mapping[str, int]
    smallest_angle: float
    sharpest: str
    smallest_jacobian: float
    worst: str
    retried: Mapping[str, tuple[str, ...]]


@dataclass(frozen=True)
class Cost:
    """What a run will need.

    Attributes
    ----------
    pairs : touching pairs of stones
    contacts : contact points at the start
    unknowns : velocities
    memory : of the largest arrays [bytes], estimated
    steps : at most
    step : [s]
    seconds : of one processor until the scene rests: low, likely and high, on this machine
    longest : if it does not come to rest before its duration is over [s]
    peak : memory of the whole program [bytes], estimated
    """

    pairs: int
    contacts: int
    unknowns: int
    memory: int
    steps: int
    step: float
    seconds: tuple[float, float, float]
    longest: float
    peak: int


@dataclass(frozen=True)
class CheckReport:
    """The plan of a scene; it is sound if there are no problems. Laws and loads are told in words.

    Attributes
    ----------
    ring : stones that deform for the sake of another one's stress
    stones : how each stone is modelled, and why; where joints could not be closed, as if there were none
    simplification, joints : what became of the stones and of their joints; None if they could not be made
    files : pictures that were drawn
    warnings : what has no effect, how far stresses reach, and what could not be drawn
    """

    scene: str
    kinds: Mapping[str, int]
    bodies: Mapping[str, int]
    ring: int
    stones: tuple[StoneModelling, ...]
    materials: tuple[MaterialUse, ...]
    meshes: tuple[MeshUse, ...]
    mesh_quality: MeshQualityReport | None
    simplification: SimplificationReport | None
    joints: JointsReport | None
    cost: Cost | None
    laws: tuple[str, ...]
    loads: tuple[str, ...]
    problems: tuple[str, ...]
    files: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
