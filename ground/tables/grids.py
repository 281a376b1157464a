"""National grids: which of two coordinates is the easting, by how large they are."""

import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files

import numpy as np
import numpy.typing as npt


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
        for name, (west, east, south, north) in _areas().items()
        if west <= easting <= east and south <= northing <= north
    )


@cache
def _areas() -> Mapping[str, tuple[float, float, float, float]]:
    """Return the areas of use of `grids.toml`: easting from, to, northing from, to [km]."""
    text = files(__package__).joinpath("grids.toml").read_text(encoding="utf-8")
    return {name: tuple(area) for name, area in tomllib.loads(text).items()}
