"""National grids: which of two coordinates is the easting, by how large they are."""

import numpy as np
import numpy.typing as npt

__all__ = ["exchanged_grid", "grid_of"]

_GRIDS: dict[str, tuple[float, float, float, float]] = {
    # easting from, to, northing from, to [km]: areas of use of the EPSG register; UTM from 3,500 km, below which the
    # northing of one grid is the easting of another
    "UTM": (166.0, 834.0, 3500.0, 10000.0),  # EPSG 32601 to 32760
    "UTM with the zone before the easting": (31166.0, 33834.0, 5200.0, 6150.0),  # EPSG 4647, 5649, 5650
    "Gauss-Krüger": (2300.0, 5700.0, 5200.0, 6150.0),  # EPSG 31466 to 31469
    "MGI (Austria)": (-120.0, 120.0, 5150.0, 5440.0),  # EPSG 31254 to 31256
    "Gauss-Boaga": (1240.0, 2850.0, 3930.0, 5220.0),  # EPSG 3003, 3004
    "Lambert-93": (99.0, 1243.0, 6046.0, 7111.0),  # EPSG 2154
    "LV95": (2485.0, 2834.0, 1075.0, 1296.0),  # EPSG 2056
}


def exchanged_grid(places: npt.NDArray[np.float64]) -> str:
    """Return the national grid that coordinates are of if easting and northing are exchanged, and of none as they are.

    Parameters
    ----------
    places : (n, 2 or 3) easting, northing and elevation [m]

    Returns
    -------
    str : its name, or names; empty if the coordinates fit a grid as they are, or fit none

    Examples
    --------
    >>> exchanged_grid(np.array([[5_403_112.0, 412_334.0]]))
    'UTM'
    >>> exchanged_grid(np.array([[412_334.0, 5_403_112.0]]))
    ''
    """
    if not len(places):
        return ""
    first, second = (float(value) for value in np.median(places[:, :2], axis=0) / 1000.0)
    return "" if grid_of(first, second) else grid_of(second, first)


def grid_of(easting: float, northing: float) -> str:
    """Return the names of the grids that have such coordinates [km]; empty if none has."""
    return " or ".join(
        name
        for name, (west, east, south, north) in _GRIDS.items()
        if west <= easting <= east and south <= northing <= north
    )
