"""Which program cuts a stone into tetrahedra."""

from enum import StrEnum

__all__ = ["Mesher"]


class Mesher(StrEnum):
    """Auto: Delaunay for convex stones, gmsh for all others; the other two are the first choice for all stones."""

    AUTO = "auto"
    GMSH = "gmsh"
    DELAUNAY = "delaunay"
