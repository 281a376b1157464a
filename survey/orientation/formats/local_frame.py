"""A frame of metres to the east, north and up at a place that is given by longitude, latitude and height (WGS 84)."""

from dataclasses import dataclass

import numpy as np

from survey.arrays import Array

_AXIS, _FLATTENING = 6378137.0, 1.0 / 298.257223563  # of the ellipsoid of WGS 84 [m], [-]


@dataclass(frozen=True)
class LocalFrame:
    """A local frame.

    Attributes
    ----------
    origin : (3,) longitude and latitude [°], height above the ellipsoid [m]
    """

    origin: Array

    @property
    def axes(self) -> Array:
        """East, north and up in rows, in geocentric axes (3, 3)."""
        lon, lat = np.radians(self.origin[:2])
        (sl, cl), (sp, cp) = (np.sin(lon), np.cos(lon)), (np.sin(lat), np.cos(lat))
        return np.array([[-sl, cl, 0.0], [-sp * cl, -sp * sl, cp], [cp * cl, cp * sl, sp]])

    def place(self, geographic: Array) -> Array:
        """Return the place (3,) of longitude, latitude [°] and height [m] in the frame [m].

        >>> frame = LocalFrame(np.array([11.0, 48.0, 500.0]))
        >>> (frame.place(np.array([11.0, 48.0, 503.0])).round(6) + 0.0).tolist()
        [0.0, 0.0, 3.0]
        """
        return self.axes @ (_geocentric(geographic) - _geocentric(self.origin))

    def moved(self, world: tuple[Array, Array, float]) -> tuple[Array, Array, float]:
        """Return rotation, shift and scale to the frame, of those to geocentric axes."""
        turn, shift, scale = world
        return self.axes @ turn, self.axes @ (shift - _geocentric(self.origin)), scale


def _geocentric(geographic: Array) -> Array:
    lon, lat, height = *np.radians(geographic[:2]), float(geographic[2])
    square = _FLATTENING * (2.0 - _FLATTENING)
    normal = _AXIS / np.sqrt(1.0 - square * np.sin(lat) ** 2)
    level = (normal + height) * np.cos(lat)
    return np.array(
        [level * np.cos(lon), level * np.sin(lon), (normal * (1.0 - square) + height) * np.sin(lat)]
    )
