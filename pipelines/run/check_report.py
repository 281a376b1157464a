"""Report of `moma check` on a scene."""

from collections.abc import Mapping
from dataclasses import dataclass

from pipelines.run.closing_check import JointsReport, SimplificationReport
from pipelines.run.filling import Filling


@dataclass(frozen=True)
class MaterialUse:
    """A material and the number of its stones."""

    name: str
    density: float
    young: float
    poisson: float
    stones: int


@dataclass(frozen=True)
class StoneModelling:
    """Model of one stone, its reason, and whether its stress is computed."""

    code: str
    fidelity: str
    reason: str
    stress: bool


@dataclass(frozen=True)
class MeshUse:
    """Finite elements of one type and target edge length [m], and the number of stones that have them."""

    element: str
    size: float
    stones: int


@dataclass(frozen=True)
class MeshQualityReport:
    """Meshes of the deformable stones.

    Attributes
    ----------
    nodes, cells : of all meshes
    distinct : meshes that had to be made; stones of one shape share theirs
    how : number of stones by mesher
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
    """Expected cost of a run.

    Attributes
    ----------
    pairs : touching pairs of stones
    open_pairs : how many of these are open all over
    widest : by how much at most [m]
    contacts : contact points at the start
    unknowns : velocities
    memory : of the largest arrays [bytes], estimated
    steps : at most
    step : [s]
    seconds : of one processor from the start of the command to its last picture: low, likely and high, on this machine
    longest : if it does not come to rest before its duration is over [s]
    unknown : the reason why the time cannot be known before the run; empty if it can
    peak : memory of the whole program [bytes], estimated
    """

    pairs: int
    open_pairs: int
    widest: float
    contacts: int
    unknowns: int
    memory: int
    steps: int
    step: float
    seconds: tuple[float, float, float]
    longest: float
    unknown: str
    peak: int


@dataclass(frozen=True)
class CheckReport:
    """Plan of a scene, which is sound if there are no problems. Laws, loads and stages are described in words.

    Attributes
    ----------
    ring : number of stones that deform for the stress of others
    stones : model of each stone, and its reason; where joints could not be closed, as if there were none
    simplification, joints : changes of the stones and of their joints; None if they could not be made
    filling : volume and weight of all stones as surveyed and as modelled; None likewise
    files : pictures that were drawn
    source : the scene file, relative to the folder of the pictures; empty if none were drawn
    cautions : facts without which "sound" misleads, the gravest first
    warnings : keys without effect, limits of the stresses, and pictures that could not be drawn
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
    stages: tuple[str, ...]
    problems: tuple[str, ...]
    files: tuple[str, ...] = ()
    source: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    cautions: tuple[str, ...] = ()
    filling: Filling | None = None
