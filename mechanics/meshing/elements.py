"""Kinds of finite elements; nodes of a cell and of its facets in the order of VTK."""

from enum import StrEnum

__all__ = ["Element"]


class Element(StrEnum):
    """A finite element: straight edges, displacement of the first or second order.

    Attributes
    ----------
    cell_nodes : nodes of a cell
    corners : how many of them are corners; they come first
    facet_nodes : nodes of a facet
    facet_corners : how many of these are corners; they come first, counter-clockwise seen from outside
    order : of the displacement along an edge
    """

    TET4 = "tet4"
    TET10 = "tet10"
    HEX8 = "hex8"
    HEX20 = "hex20"
    HEX27 = "hex27"

    @property
    def cell_nodes(self) -> int:  # noqa: D102 - see the class
        return int(self.value[3:])

    @property
    def corners(self) -> int:  # noqa: D102
        return 4 if self.is_tetrahedron else 8

    @property
    def facet_nodes(self) -> int:  # noqa: D102
        return {"tet4": 3, "tet10": 6, "hex8": 4, "hex20": 8, "hex27": 9}[self.value]

    @property
    def facet_corners(self) -> int:  # noqa: D102
        return 3 if self.is_tetrahedron else 4

    @property
    def order(self) -> int:  # noqa: D102
        return 1 if self in (Element.TET4, Element.HEX8) else 2

    @property
    def is_tetrahedron(self) -> bool:
        """A tetrahedron, not a hexahedron."""
        return self.value.startswith("tet")
