"""Convex parts of any stone."""

from survey.geometry.convex_parts import convex_parts
from survey.geometry.infill_parts import grid_parts
from survey.geometry.solids import Solid

__all__ = ["stone_parts"]

_MANY = 40  # faces of a solid from which it is first looked at as a storey of infill


def stone_parts(solid: Solid) -> tuple[Solid, ...]:
    """Cut a stone into convex parts; a storey of infill, which has hundreds of faces, by its own grid.

    Returns
    -------
    the parts; the solid itself if it is convex

    Raises
    ------
    GeometryError
        if it has too many parts
    """
    return (grid_parts(solid) if len(solid.faces) > _MANY else None) or convex_parts(solid)
