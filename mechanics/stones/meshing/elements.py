"""Kinds of finite elements, with the nodes of a cell and of its facets in VTK's order."""

from enum import StrEnum
from functools import cache

# corners of the edges, of the quadrilateral sides and of the boundary facets, in VTK's order
_TET_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
_TET_FACETS = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
_HEX_EDGES = (
    *((0, 1), (1, 2), (2, 3), (0, 3), (4, 5), (5, 6)),
    *((6, 7), (4, 7), (0, 4), (1, 5), (2, 6), (3, 7)),
)
_HEX_FACETS = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))


class Element(StrEnum):
    """A finite element: straight edges, displacement of the first or second order.

    Attributes
    ----------
    cell_nodes : nodes of a cell
    corners : number of corners among them; they come first
    facet_nodes : nodes of a facet
    facet_corners : number of corners among them; they come first, counter-clockwise seen from outside
    order : of the displacement along an edge
    """

    TET4 = "tet4"
    TET10 = "tet10"
    HEX8 = "hex8"
    HEX20 = "hex20"
    HEX27 = "hex27"

    @property
    def cell_nodes(self) -> int:
        """Nodes of a cell."""
        return int(self.value[3:])

    @property
    def corners(self) -> int:
        """Number of corners among them."""
        return 4 if self.is_tetrahedron else 8

    @property
    def facet_nodes(self) -> int:
        """Nodes of a facet."""
        return {"tet4": 3, "tet10": 6, "hex8": 4, "hex20": 8, "hex27": 9}[self.value]

    @property
    def facet_corners(self) -> int:
        """Number of corners among them."""
        return 3 if self.is_tetrahedron else 4

    @property
    def order(self) -> int:
        """Order of the displacement along an edge."""
        return 1 if self in (Element.TET4, Element.HEX8) else 2

    @property
    def is_tetrahedron(self) -> bool:
        """A tetrahedron, not a hexahedron."""
        return self.value.startswith("tet")

    @property
    def linear(self) -> "Element":
        """The element of the first order with the same corners."""
        return Element.TET4 if self.is_tetrahedron else Element.HEX8

    @property
    def node_corners(self) -> tuple[tuple[int, ...], ...]:
        """For each node of a cell, the corners of the cell of which it is the mean; a corner is its own."""
        return _node_corners(self)

    @property
    def cell_facets(self) -> tuple[tuple[int, ...], ...]:
        """The facets of a cell: its nodes in VTK's order, corners counter-clockwise seen from outside."""
        return _cell_facets(self)


@cache
def _node_corners(element: Element) -> tuple[tuple[int, ...], ...]:
    nodes: tuple[tuple[int, ...], ...] = tuple((corner,) for corner in range(element.corners))
    if element.order == 2:
        nodes += _TET_EDGES if element.is_tetrahedron else _HEX_EDGES
    if element is Element.HEX27:
        nodes += (*(tuple(sorted(facet)) for facet in _HEX_FACETS), tuple(range(8)))
    return nodes


@cache
def _cell_facets(element: Element) -> tuple[tuple[int, ...], ...]:
    number = {corners: node for node, corners in enumerate(_node_corners(element))}
    facets: list[tuple[int, ...]] = []
    for corners in _TET_FACETS if element.is_tetrahedron else _HEX_FACETS:
        nodes: tuple[int, ...] = corners
        if element.order == 2:
            following = (*corners[1:], corners[0])
            nodes += tuple(number[min(a, b), max(a, b)] for a, b in zip(corners, following, strict=True))
        if element is Element.HEX27:
            nodes += (number[tuple(sorted(corners))],)
        facets.append(nodes)
    return tuple(facets)
