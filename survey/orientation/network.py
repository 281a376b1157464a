"""Photographs, their cameras, and the points marked on them, before anything is computed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from survey.arrays import Array
from survey.conventions import LISTED

INTERIOR = ("c", "xp", "yp", "as", "sk", "K1", "K2", "K3", "P1", "P2")
"""Parameters of the interior orientation, in the order of the kernels."""


@dataclass(frozen=True)
class Camera:
    """A camera: its interior orientation and the model of its distortion.

    Attributes
    ----------
    name : unique in its network
    inner : (10,) values of `INTERIOR`: camera constant, principal point from the upper left corner to the right
        and down [unit], affinity and skew [-], radial [unit⁻², unit⁻⁴, unit⁻⁶] and decentring [unit⁻¹] distortion
    size : width and height of a photograph [px]
    pixel : height of a pixel [unit]
    unit : of the image, "mm" or "px"
    forward : the distortion is applied to what is projected, as computer vision does; False: to what was measured, as
        photogrammetry does
    free : parameters that are estimated, of `INTERIOR`
    where : ``file:line``
    """

    name: str
    inner: Array
    size: tuple[int, int]
    pixel: float
    unit: str = "mm"
    forward: bool = False
    free: tuple[str, ...] = ()
    where: str = ""

    @property
    def model(self) -> str:
        """Name of the model of its distortion."""
        return "forward" if self.forward else "backward"


@dataclass(frozen=True)
class Photo:
    """A photograph with what is known of its orientation beforehand.

    Attributes
    ----------
    name : unique in its network
    camera : index of its camera
    rotation : (3, 3) to start from, the camera's axes in columns: x to the right, y upwards, z backwards; None:
        not known
    station : (3,) place of the projection centre to start from [m]; None: not known
    observed_station, station_sigma : (3,) observed place and its standard deviations [m]; None: not observed
    observed_rotation, angle_sigma : (3, 3) observed rotation, and (3,) standard deviations of its ω, φ, κ [rad];
        None: not observed
    fixed : its orientation is not estimated
    where : ``file:line``
    """

    name: str
    camera: int
    rotation: Array | None = None
    station: Array | None = None
    observed_station: Array | None = None
    station_sigma: Array | None = None
    observed_rotation: Array | None = None
    angle_sigma: Array | None = None
    fixed: bool = False
    where: str = ""


@dataclass(frozen=True)
class Control:
    """A point whose place was measured otherwise.

    Attributes
    ----------
    point : its index in the network
    place : (3,) [m]
    covariance : (3, 3) [m²]; zero: the place is fixed
    check : it takes no part in the adjustment, and checks it
    where : ``file:line``
    """

    point: int
    place: Array
    covariance: Array
    check: bool = False
    where: str = ""

    @property
    def fixed(self) -> bool:
        """True if the place is not estimated."""
        return not self.covariance.any()


@dataclass(frozen=True)
class ScaleBar:
    """A measured distance between two points.

    Attributes
    ----------
    points : indices of the two points in the network
    length, sigma : measured, and its standard deviation [m]
    where : ``file:line``
    """

    points: tuple[int, int]
    length: float
    sigma: float
    where: str = ""


@dataclass(frozen=True)
class PlumbLine:
    """Points that lie above each other.

    Attributes
    ----------
    points : indices in the network, from the lowest to the highest
    sigma : standard deviation of the level distance of a point from the plumb line of the lowest, in x and in y [m]
    where : ``file:line``
    """

    points: tuple[int, ...]
    sigma: float
    where: str = ""


@dataclass(frozen=True)
class Network:
    """Everything that a bundle adjustment starts from.

    Attributes
    ----------
    path : the file that it was read from
    cameras, photos : in the order of the file
    names : of the points
    start : (np, 3) places to start from [m]; nan: not known
    control : control points and check points
    photo, point : (n,) indices, of each marked point
    image : (n, 2) its place on the photograph, to the right and down from the upper left corner [px]
    sigma : (n, 2) standard deviation of these [px]
    lines : (n,) line of the file
    remarks : what the reader changed or left out, in words
    bars, plumb_lines : measured distances, and points above each other
    start_datum : the user has said that scale and vertical of the start values are right
    """

    path: str
    cameras: tuple[Camera, ...]
    photos: tuple[Photo, ...]
    names: tuple[str, ...]
    start: Array
    control: tuple[Control, ...]
    photo: NDArray[np.int64]
    point: NDArray[np.int64]
    image: Array
    sigma: Array
    lines: NDArray[np.int64]
    remarks: tuple[str, ...] = ()
    frame: Mapping[str, object] = field(default_factory=dict)
    bars: tuple[ScaleBar, ...] = ()
    plumb_lines: tuple[PlumbLine, ...] = ()
    start_datum: bool = False

    def where(self, ray: int) -> str:
        """Return ``file:line`` of a marked point."""
        return f"{self.path}:{self.lines[ray]}" if self.lines[ray] > 0 else self.path

    def camera_of(self, photo: int) -> Camera:
        """Return the camera of a photograph."""
        return self.cameras[self.photos[photo].camera]


def listed(words: Sequence[str], most: int = LISTED) -> str:
    """List names, the first of them if they are many."""
    more = len(words) - most
    return ", ".join(words[:most]) + (f" and {more} more" if more > 0 else "")
