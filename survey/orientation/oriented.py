"""Oriented photographs, as `moma orient` leaves them behind for the stones that are measured on them."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ground.errors import SurveyError
from survey.arrays import Array
from survey.orientation.network import Camera, Photo, listed


@dataclass(frozen=True)
class Oriented:
    """Photographs with adjusted orientations and their joint precision.

    Attributes
    ----------
    path : the file that they were read from
    cameras : with adjusted values
    photos : with adjusted rotations and stations
    table : (nf, 16) columns of each photograph's rotation, station and interior orientation in `covariance`; -1:
        without error
    covariance : (nr, nr) of all of them together, with σ₀² in it [rad, m, camera unit]
    mark_sigma : standard deviation of a coordinate marked on them, as the adjustment found it [px]
    unknown : of "scale" and "vertical", what nothing tells
    left_out : photographs that were left out, with the reason
    """

    path: str
    cameras: tuple[Camera, ...]
    photos: tuple[Photo, ...]
    table: NDArray[np.int64]
    covariance: Array
    mark_sigma: float
    unknown: tuple[str, ...] = ()
    left_out: Mapping[str, str] = field(default_factory=dict)

    def index(self, name: str, where: str) -> int:
        """Return the index of a photograph.

        Raises
        ------
        SurveyError
            if there is none of this name
        """
        for number, photo in enumerate(self.photos):
            if photo.name == name:
                return number
        names = [photo.name for photo in self.photos]
        raise SurveyError(
            f"no photograph {name} in {self.path}", where=where, remedy=f"oriented are {listed(names)}"
        )

    def camera(self, photo: int) -> Camera:
        """Return the camera of a photograph."""
        return self.cameras[self.photos[photo].camera]

    def rotation(self, photo: int) -> Array:
        """Return the rotation of a photograph, (3, 3)."""
        rotation = self.photos[photo].rotation
        assert rotation is not None
        return rotation

    def station(self, photo: int) -> Array:
        """Return the station of a photograph, (3,) [m]."""
        station = self.photos[photo].station
        assert station is not None
        return station
