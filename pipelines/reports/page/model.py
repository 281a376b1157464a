"""Content of a viewer: stones, what is known of them, and what a run found, in plain arrays."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mechanics.arrays import Array, Bools, Ints
from survey.arrays import AXES


@dataclass(frozen=True)
class Stones:
    """Surfaces of all stones as one mesh.

    Attributes
    ----------
    codes : of the stones
    vertices : (nv, 3) at the start [m]
    owner : (nv,) the stone of each vertex
    triangles : (nt, 3) vertices, counter-clockwise seen from outside
    edges : (ne, 2) vertices
    """

    codes: Sequence[str]
    vertices: Array
    owner: Ints
    triangles: Ints
    edges: Ints


@dataclass(frozen=True)
class Column:
    """One attribute or result of all stones.

    Attributes
    ----------
    name : as in queries
    label : for people
    unit : SI unit; "-" for counts and ratios; None for texts
    values : (n,) numbers, NaN where not known; or texts, None where not known
    group : heading under which the viewer lists it
    """

    name: str
    label: str
    unit: str | None
    values: Array | Sequence[str | None]
    group: str = "Attributes"


@dataclass(frozen=True)
class VertexField:
    """A field on the surface, at the last instant: (nv,) values, NaN where there are none."""

    name: str
    label: str
    unit: str
    values: NDArray[np.floating]


@dataclass(frozen=True)
class Motion:
    """Motion of the stones as rigid bodies, and the deformation that remains at the last instant.

    Attributes
    ----------
    times : (nf,) [s]
    centres : (n, 3) points about which the stones turn, at the start [m]
    shift : (nf, n, 3) displacement of these points [m]
    turn : (nf, n, 3) rotation vectors [rad]
    supports : (n,) stones that are fixed or driven
    rest : (nv, 3) displacement of the vertices at the last instant beyond the rigid motion [m]; None without
    values : named results of each stone in each instant, (nf, n): label, unit, values
    """

    times: Array
    centres: Array
    shift: Array
    turn: Array
    supports: Bools
    rest: Array | None = None
    values: Sequence[tuple[str, str, Array]] = ()


@dataclass(frozen=True)
class Joints:
    """Joints and their resultants at the last instant.

    Attributes
    ----------
    bodies : (nj, 2) stones
    polygons : (k, 3) corners of each joint, where the second stone was at the start [m]
    place : (nj, 3) where the resultant meets the joint, likewise; NaN without compression [m]
    force : (nj, 3) on the first stone [N]
    kern : (nj,) up to 1 within the kern; NaN without compression
    columns : results of the joints; `Column.values` are (nj,)
    """

    bodies: Ints
    polygons: Sequence[Array]
    place: Array
    force: Array
    kern: Array
    columns: Sequence[Column]


@dataclass(frozen=True)
class Mechanism:
    """One way to fall: velocity (n, 6) of each stone, translation of its centre and rotation; `forces` at the limit."""

    name: str
    about: str
    centres: Array
    velocity: Array
    joints: Joints | None = None


@dataclass(frozen=True)
class Lines:
    """Polylines under a name: points (k, 3) of each [m]; `colour` #rrggbb."""

    name: str
    colour: str
    lines: Sequence[Array]


@dataclass(frozen=True)
class Points:
    """Measured points: (n, 3) places [m], the stone of each, and whether it was left out as a blunder."""

    places: Array
    owner: Ints
    rejected: Bools


@dataclass(frozen=True)
class Relations:
    """Relations (n, 2) between stones, subject and object, and the number of the name (n,) of each."""

    pairs: Ints
    kind: Ints
    names: Sequence[str]
    inverse: Sequence[str]


@dataclass(frozen=True)
class Event:
    """One line of a stone's history: when, who, what."""

    stone: int
    when: str
    who: str
    what: str


@dataclass(frozen=True)
class Model:
    """Content of a viewer.

    Attributes
    ----------
    title : of the building or scene
    stones : the geometry
    columns : what is known of the stones
    colour : name of the column, field or value that colours at first
    towards : (3,) direction to the observer of the main elevation
    origin : (3,) to be added to places for those of the site [m]
    axes : names of the axes of the picture
    notes : what the reader must know of the picture
    """

    title: str
    stones: Stones
    columns: Sequence[Column] = ()
    fields: Sequence[VertexField] = ()
    motion: Motion | None = None
    joints: Joints | None = None
    mechanisms: Sequence[Mechanism] = ()
    lines: Sequence[Lines] = ()
    points: Points | None = None
    relations: Relations | None = None
    events: Sequence[Event] = ()
    colour: str | None = None
    towards: Array = field(default_factory=lambda: np.array([0.0, -1.0, 0.0]))
    origin: Array = field(default_factory=lambda: np.zeros(AXES))
    axes: tuple[str, str, str] = ("x", "y", "z")
    notes: Sequence[str] = ()
