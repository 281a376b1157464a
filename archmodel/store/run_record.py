"""Plain values of a simulation run that go into the database, without SQLAlchemy.

Joints and contact points, of which a run can have a million, are columns of arrays; in them NaN marks an undefined
value, and becomes null.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from archmodel.arrays import Array, Values

Columns = Mapping[str, Values]
"""Columns of a table by name, equally long."""

# by unit: 10⁻¹² of a metre, of 1 MN and of 1 MPa, which are usual in masonry
_ROUNDING: Mapping[str, float] = {"m": 1e-12, "N": 1e-6, "Pa": 1e-6}


def without_rounding(value: float, unit: str | None) -> float:
    """Return a number as people read it: 0 where it is so small that rounding alone made it, else as it is.

    >>> without_rounding(9.6e-12, "Pa"), without_rounding(-6e-17, "m"), without_rounding(2e-9, "m")
    (0.0, 0.0, 2e-09)
    """
    return 0.0 if abs(value) < _ROUNDING.get(unit or "", 0.0) else value


@dataclass(frozen=True)
class StoneResult:
    """Results of a run for one stone.

    Attributes
    ----------
    code : the stone
    fidelity : fixed, rigid or deformable
    von_mises_p99 : exceeded in 1 % of its volume [Pa]; None if the stone was rigid
    von_mises_max, von_mises_mean : [Pa]; None if the stone was rigid
    displacement_max : of its points, at the end [m]
    contact_force_max : largest force of one contact point [N]
    values : further named numbers; those of `archmodel.quantities` can be asked for
    """

    code: str
    fidelity: str
    von_mises_p99: float | None
    von_mises_max: float | None
    von_mises_mean: float | None
    displacement_max: float
    contact_force_max: float | None
    values: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class StructureValues:
    """Results of a run for one structure.

    Attributes
    ----------
    number : its primary key
    code, kind : of the structure
    members : codes of its stones
    values : by name, as in `archmodel.quantities`
    """

    number: int
    code: str
    kind: str
    members: frozenset[str]
    values: Mapping[str, float]


@dataclass(frozen=True)
class ErrorMeasures:
    """Error measures of a run, as defined in docs/theory.md §4 [-]; None where not measured.

    Attributes
    ----------
    natural_map : η, how far the contact forces are from their laws
    penetration : deepest overlap over the smallest block's size
    balance : unbalanced force of a block over its weight, largest
    reaction : |vertical support reaction - weight| over weight
    energy : energy that no term of the balance explains, over the reference energy
    """

    natural_map: float | None = None
    penetration: float | None = None
    balance: float | None = None
    reaction: float | None = None
    energy: float | None = None


@dataclass(frozen=True)
class SimplificationRecord:
    """Solid that stood for a stone, in the frame of the site, and its distance from the surveyed one.

    Attributes
    ----------
    code : the stone
    mode : what became of the joints: close, mortar or as-surveyed
    displacement_max : largest distance of a corner from the nearest surveyed one [m]
    volume_change : volume over that of the surveyed solid, minus 1 [-]
    vertices : (nv, 3) [m]
    faces : vertex indices of each face, counter-clockwise seen from outside
    shape : what the surveyed solid was simplified to before its joints were closed, e.g. hexahedron; None if it was not
    blockiness : what the surveyed solid and a hexahedron have in common, over what they fill together; None if not
        known [-]
    worst_angle : largest departure from a right angle between two of its faces; None if not known [rad]
    within_tolerance : whether simplifying kept within what the survey can tell; None if not known
    """

    code: str
    mode: str
    displacement_max: float
    volume_change: float
    vertices: Array
    faces: tuple[tuple[int, ...], ...]
    shape: str | None = None
    blockiness: float | None = None
    worst_angle: float | None = None
    within_tolerance: bool | None = None


@dataclass(frozen=True)
class MovingStone:
    """A stone that moves in a mechanism.

    Attributes
    ----------
    code : the stone
    speed : over that of the fastest [-]
    velocity, spin : (3,) of its centre, the fastest corner of all at 1 [m/s, rad/s]
    """

    code: str
    speed: float
    velocity: tuple[float, float, float]
    spin: tuple[float, float, float]


@dataclass(frozen=True)
class RunRecord:
    """One simulation run.

    Attributes
    ----------
    scene : its name
    scene_text : the scene file as it was run
    outcome : equilibrium, settled, moving, collapsed, undecided, interrupted, assessed, pushed or studied
    summary : the contents of summary.json
    versions : of the programs and libraries, by name; at least of "moma"
    results : one per stone of the scene
    structures : those of courses, arches and other structures that have any
    settings : of time, solver and contacts as they were used, defaults filled in, in values that JSON can hold
    as_of : the last entry in the database when its stones were read; None if that is not known
    steps : how many were done
    simulated, wall : simulated time and time of work [s]
    errors : its error measures
    joints, contacts : columns of the tables `joint_result` and `contact_point` at its end, without run and number, with
        `first` and `second`, or `candidate` and `antagonist`, indices into `results`; None if they are not kept
    simplifications : of its stones; () if they are not kept
    mechanisms : of an assessment, the stones that move by the name of its load
    cells : of a run of disks, the columns of the rows of each cell by its name: at least step and time; NaN: unknown
    """

    scene: str
    scene_text: str
    outcome: str
    summary: Mapping[str, object]
    versions: Mapping[str, str]
    results: tuple[StoneResult, ...]
    settings: Mapping[str, object] = field(default_factory=dict)
    as_of: int | None = None
    steps: int | None = None
    simulated: float | None = None
    wall: float | None = None
    errors: ErrorMeasures = field(default_factory=ErrorMeasures)
    joints: Columns | None = None
    contacts: Columns | None = None
    simplifications: tuple[SimplificationRecord, ...] = ()
    mechanisms: Mapping[str, tuple[MovingStone, ...]] = field(default_factory=dict)
    cells: Mapping[str, Mapping[str, Array]] = field(default_factory=dict)
    structures: tuple[StructureValues, ...] = ()
