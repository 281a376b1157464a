"""Contents of a survey file, before anything is computed from them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from ground.errors import MomaError, SurveyError
from survey.arrays import Array, no_pixels
from survey.records.review import Doubtful
from survey.records.snapping import Snapping

DEPTH_ORIGINS = ("stone", "rule", "kind", "structure", "solid")
"""Origins of a depth that a record may state, as `query` gives them; that of a solid is measured on the stone."""

OBSERVER = "observer"
"""Name of the station from which stones without a station of their own were seen."""

OUTLINE_NOTE = "mask"
"""Note of stones that came in as outlines alone: how precise these are."""

FRAME_NOTE = "frame"
"""Note of stones from a picture or drawing of stated size: how far it reaches beyond the outline of the stone to the
left, downwards, to the right and upwards, as four numbers [m]."""


@dataclass(frozen=True)
class Station:
    """Position of an instrument or of the observer.

    Attributes
    ----------
    name : unique in its survey
    position : (3,) [m]
    line : line of the file, counted from 1
    """

    name: str
    position: Array
    line: int = 0


@dataclass(frozen=True)
class ControlPoint:
    """A point known in the frame of the survey and in that of the site.

    Attributes
    ----------
    name : unique in its survey
    measured : (3,) in the frame of the survey [m]
    measured_sigma : standard deviation of each of its coordinates [m]
    site : (3,) in the frame of the site [m]
    site_sigma : standard deviation of each of its coordinates [m]
    line : line of the file, counted from 1
    """

    name: str
    measured: Array
    measured_sigma: float
    site: Array
    site_sigma: float
    line: int = 0


@dataclass(frozen=True)
class PhotoMark:
    """A point of the wall seen on a photograph and known in space.

    Attributes
    ----------
    image : (2,) its place on the photograph, u to the right, v either down or up [px]
    position : (3,) in the frame of the survey [m]
    sigma : standard deviation of each coordinate of `position` [m]
    line : line of the file, counted from 1
    """

    image: Array
    position: Array
    sigma: float
    line: int = 0


@dataclass(frozen=True)
class Photograph:
    """A photograph of a plane wall on which stones were measured.

    Attributes
    ----------
    name : unique in its survey
    sigma : standard deviation of a coordinate measured on it [px]
    marks : four or more points that tie it to the wall
    station : name of the station that it was taken from; None if not known
    line : line of the file, counted from 1
    """

    name: str
    sigma: float
    marks: tuple[PhotoMark, ...]
    station: str | None = None
    line: int = 0


@dataclass(frozen=True)
class PointMark:
    """A point of a stone marked on an oriented photograph.

    Attributes
    ----------
    name : of the point; the same on all photographs that show it
    role : "vertex", a corner of the face, or "point", any other point on it
    photograph : name of the photograph
    image : (2,) its place on the photograph, to the right and down from the upper left corner [px]
    sigma : standard deviation of a coordinate of it [px]; None: as the orientation found it
    line : line of the file, counted from 1
    """

    name: str
    role: str
    photograph: str
    image: Array
    sigma: float | None = None
    line: int = 0


@dataclass(frozen=True)
class SurfaceRule:
    """A surface that the faces of several stones lie on.

    Attributes
    ----------
    name : unique in its survey
    kind : "plane" or "cylinder"
    sigma : standard deviation of faces about it [m]; None: as far as their points show it
    line : line of the file, counted from 1
    """

    name: str
    kind: str
    sigma: float | None = None
    line: int = 0


@dataclass(frozen=True)
class DepthRule:
    """The depth of stones that were not measured individually.

    Attributes
    ----------
    kind : the kind of stone; None for every stone of the structure
    depth : [m]
    sigma : standard deviation [m]; None if not known
    source : the evidence, in words
    line : line of the file, counted from 1
    courses : first and last course that it holds for; None for all
    zone : part of the building that it holds for; None for all
    """

    kind: str | None
    depth: float
    sigma: float | None
    source: str
    line: int = 0
    courses: tuple[int, int] | None = None
    zone: str | None = None


@dataclass(frozen=True)
class Canon:
    """The usual face of a kind of stone, according to archaeologists.

    Attributes
    ----------
    kind : the kind of stone
    length, height : of its face, level and upwards [m]
    sigma : standard deviation of sound stones from it [m]
    source : the evidence, in words
    line : line of the file, counted from 1
    """

    kind: str
    length: float
    height: float
    sigma: float
    source: str
    line: int = 0


@dataclass(frozen=True)
class Extrusion:
    """Direction and size of the hidden side behind the face.

    Attributes
    ----------
    direction : (3,) from the face into the wall, of any length; None: square to the face
    tail : size of the hidden face over that of the visible one, 0 < tail ≤ 1 [-]
    """

    direction: Array | None = None
    tail: float = 1.0


@dataclass(frozen=True)
class SurveyHead:
    """The data of a survey file that all its stones share.

    Attributes
    ----------
    name : name of the survey
    path : the file it was read from
    stations : positions of instruments and observers
    control : points also known in the frame of the site; without any, the survey is in that frame
    photographs : on which stones were measured
    depth_rules : depths of stones without a depth of their own
    canons : usual dimensions, at most one per kind
    extrusion : of stones without an extrusion of their own
    orientation : result of the orientation of the photographs that stones were marked on; None: none were
    surfaces : that stones marked on one photograph lie on
    roughness : standard deviation of faces about their planes [m]; None: as far as all faces show it
    """

    name: str
    path: str
    stations: tuple[Station, ...] = ()
    control: tuple[ControlPoint, ...] = ()
    photographs: tuple[Photograph, ...] = ()
    depth_rules: tuple[DepthRule, ...] = ()
    canons: tuple[Canon, ...] = ()
    extrusion: Extrusion = Extrusion()
    orientation: str | None = None
    surfaces: tuple[SurfaceRule, ...] = ()
    roughness: float | None = None

    def viewpoint(self, station: str | None) -> Array | None:
        """Return the viewpoint of a stone, (3,) [m]: its own station, then the observer, then the only station.

        Raises
        ------
        SurveyError
            if there is no station of that name
        """
        wanted = station or OBSERVER
        for candidate in self.stations:
            if candidate.name == wanted:
                return candidate.position
        if station is not None:
            known = ", ".join(station.name for station in self.stations) or "none"
            raise SurveyError(f"no station {station!r}", remedy=f"stations of this survey: {known}")
        return self.stations[0].position if len(self.stations) == 1 else None


@dataclass(frozen=True)
class BlockRecord:
    """One stone as measured.

    Attributes
    ----------
    code : the stone's name, unique in its survey
    kind : e.g. "header"
    course : number of its course, counted from the ground; None if it belongs to none
    vertices : (nv, 3) corners of the visible face, in order around it, nv ≥ 3 [m]; none on a photograph
    points : (np, 3) further points on the visible face [m]
    sigma : standard deviation of one measured coordinate [m]; of those in `sigmas`, root mean square
    depth : depth measured on the stone itself, unless `depth_origin` says otherwise [m]; None if it was not
    depth_sigma : its standard deviation [m]; None if not known
    depth_source : evidence for the depth; None if there is no depth
    depth_origin : one of DEPTH_ORIGINS, of a depth that is not the stone's; None: measured on the stone
    line : line of the file on which the record begins, counted from 1
    notes : the surveyor's remarks, e.g. {"edge": "eroded"}
    zone : part of the building, e.g. "north wall"; None if not stated
    station : name of the station that it was seen from; None if not stated
    photograph : name of the photograph that the corners were measured on; None if they were measured in space
    image : (nv, 2) the corners on that photograph [px]
    sigmas : (np + nv,) standard deviation of a coordinate of each point, then of each corner [m]; None: all
        `sigma`
    names : of each point, then of each corner, as the instrument numbers them; () if they have none
    extrusion : of its hidden side; None: as for the whole survey
    spans : lines of the file that it was read from
    marks : its points marked on oriented photographs, from which `points` and `vertices` are located
    surface : name of the surface that its face lies on; None: the plane of its own points
    seen_from : (3,) mean of the stations of the photographs that show it [m]; None if it was not marked on any
    joint : (9n²,) covariance of the coordinates of the n points, then corners, by rows, with the errors that they share
        [m²]; None: their errors are independent
    evidence : of each point, then of each corner, how it was located, in plain values; () if they were measured in
        space
    roughness : standard deviation of its face about a plane, beyond the precision of its points [m]
    """

    code: str
    kind: str
    course: int | None
    vertices: Array
    points: Array
    sigma: float
    depth: float | None = None
    depth_sigma: float | None = None
    depth_source: str | None = None
    line: int = 0
    notes: Mapping[str, str] = field(default_factory=dict)
    zone: str | None = None
    station: str | None = None
    photograph: str | None = None
    image: Array = field(default_factory=no_pixels)
    sigmas: Array | None = None
    names: tuple[str, ...] = ()
    extrusion: Extrusion | None = None
    spans: tuple[range, ...] = ()
    marks: tuple[PointMark, ...] = ()
    surface: str | None = None
    seen_from: Array | None = None
    joint: Array | None = None
    evidence: tuple[Mapping[str, object], ...] = ()
    roughness: float = 0.0
    depth_origin: str | None = None

    def lateral_sigmas(self, normal: Array) -> Array:
        """Return the standard deviation of each corner along any direction square to a unit vector, (nv,) [m].

        A scatter beyond the stated one is of the measurement, in all directions, unless rays of photographs tell
        that it is across the face.
        """
        if self.joint is None:
            return np.hypot(self.vertex_sigmas, self.roughness)
        count = len(self.points) + len(self.vertices)
        blocks = np.einsum("iaib->iab", self.joint.reshape(count, 3, count, 3))[len(self.points) :]
        across = np.trace(blocks, axis1=1, axis2=2) - np.einsum("a,iab,b->i", normal, blocks, normal)
        return np.asarray(np.sqrt(0.5 * across))

    @property
    def point_and_vertex_sigmas(self) -> Array:
        """Standard deviation of a coordinate of each point, then of each corner, (np + nv,) [m]."""
        return np.concatenate([self.point_sigmas, self.vertex_sigmas])

    @property
    def point_sigmas(self) -> Array:
        """Standard deviation of a coordinate of each point, (np,) [m]."""
        count = len(self.points)
        return np.full(count, self.sigma) if self.sigmas is None else self.sigmas[:count]

    @property
    def vertex_sigmas(self) -> Array:
        """Standard deviation of a coordinate of each corner, (nv,) [m]."""
        if self.sigmas is None:
            return np.full(len(self.vertices), self.sigma)
        return self.sigmas[len(self.points) :]


@dataclass(frozen=True)
class SolidRecord:
    """One closed stone imported from another program.

    Attributes
    ----------
    code : the stone's name, unique in its file
    kind : e.g. "header"
    course : number of its course; None if it belongs to none
    vertices : (nv, 3) [m]
    faces : vertex indices of each planar face, counter-clockwise seen from outside
    line : line of the file on which it begins, counted from 1; 0 in a binary file
    spans : lines of the file that it was read from
    remarks : changes that made it a solid with plane faces, in words
    file : that it was read from; empty: the only one of the survey
    """

    code: str
    kind: str
    course: int | None
    vertices: Array
    faces: tuple[tuple[int, ...], ...]
    line: int = 0
    spans: tuple[range, ...] = ()
    remarks: tuple[str, ...] = ()
    file: str = ""


@dataclass(frozen=True)
class Reject:
    """Part of a file that could not be read as a stone, with the reason.

    Attributes
    ----------
    code : of the stone; None if it cannot be read either
    error : with the place and the remedy
    spans : its lines of the file
    """

    code: str | None
    error: MomaError
    spans: tuple[range, ...] = ()


@dataclass(frozen=True)
class SurveyStream:
    """A survey file while it is read: its head, and its stones one by one.

    Attributes
    ----------
    head : data shared by all stones
    blocks : the stones in the order of the file, an iterator to be consumed once; a wrong stone comes as a
        Reject, a file that is wrong as a whole raises SurveyError
    snapping : of solids, the changes that brought their faces into common planes; None if not asked for
    header : number of the lines at its beginning that hold for all stones
    remarks : on how the file was read, in words
    review : of outlines, what to look at
    """

    head: SurveyHead
    blocks: Iterator[BlockRecord | SolidRecord | Reject]
    snapping: Snapping | None = None
    header: int = 0
    remarks: tuple[str, ...] = ()
    review: tuple[Doubtful, ...] = ()


@dataclass(frozen=True)
class Survey:
    """The contents of one survey file.

    Attributes
    ----------
    head : data shared by all stones
    blocks : the stones, in the order of the file
    """

    head: SurveyHead
    blocks: tuple[BlockRecord, ...]
