"""Choice of the program that cuts stones into tetrahedra."""

from enum import StrEnum


class Mesher(StrEnum):
    """Mesher of tetrahedra: Delaunay for convex stones and gmsh for others, or one to try first for all stones."""

    AUTO = "auto"
    GMSH = "gmsh"
    DELAUNAY = "delaunay"
