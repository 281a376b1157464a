"""Shape functions of the finite elements, from scikit-fem, with nodes in VTK's order.

All cells of a kind share one reference cell, so a kind is tabulated once, and all cells of a mesh are evaluated in one
array operation; a basis of scikit-fem costs several milliseconds for each stone.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import skfem
from skfem.quadrature import get_quadrature

from mechanics.arrays import Array, Ints
from mechanics.stones.meshing.elements import Element

_SKFEM = {
    Element.TET4: skfem.ElementTetP1,
    Element.TET10: skfem.ElementTetP2,
    Element.HEX8: skfem.ElementHex1,
    Element.HEX20: skfem.ElementHexS2,
    Element.HEX27: skfem.ElementHex2,
}
# corners of the reference cells, [0, 1]³ for hexahedra
_TET_CORNERS = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
_HEX_CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))


@dataclass(frozen=True)
class Tabulated:
    """Shape functions at the points of a quadrature rule of the reference cell.

    Attributes
    ----------
    weight : (nq,) of the points [-]
    value : (nq, k) of each node's function [-]
    slope : (nq, k, 3) their derivatives by the reference coordinates [-]
    corner_value, corner_slope : (nq, corners) and (nq, corners, 3) the same of the element of the first order,
        which maps the reference cell to the cell
    """

    weight: Array
    value: Array
    slope: Array
    corner_value: Array
    corner_slope: Array


@dataclass(frozen=True)
class Integration:
    """A quadrature rule on all cells of a mesh.

    Attributes
    ----------
    volume : (nc, nq) weight times Jacobian of each point [m³]
    value : (nq, k) shape functions, the same in all cells [-]
    gradient : (nc, nq, k, 3) of the shape functions by x, y, z [1/m]
    point : (nc, nq, 3) places [m]
    """

    volume: Array
    value: Array
    gradient: Array
    point: Array


def integration(element: Element, nodes: Array, cells: Ints, order: int) -> Integration:
    """Evaluate a rule that is exact for polynomials of an order (in each direction for hexahedra) on cells (nc, k)."""
    table = tabulated(element, order)
    corners = nodes[cells[:, : element.corners]]
    jacobian = _jacobian(table.corner_slope[:1] if element.is_tetrahedron else table.corner_slope, corners)
    return Integration(
        volume=np.linalg.det(jacobian) * table.weight,
        value=table.value,
        gradient=table.slope @ np.linalg.inv(jacobian),
        point=table.corner_value @ corners,
    )


def jacobians(element: Element, nodes: Array, cells: Ints) -> Array:
    """Return determinants of ∂x/∂ξ (nc, 1 or 27) [m³]; a sound cell has positive ones only.

    In a hexahedron the determinant is of the second order in each direction; it is given at corners, and at the
    middle of edges, sides and cell.
    """
    places = np.full((3, 1), 0.25) if element.is_tetrahedron else reference_points(Element.HEX27).T
    _, slope = _evaluate(element.linear, places)
    determinant: Array = np.linalg.det(_jacobian(slope, nodes[cells[:, : element.corners]]))
    return determinant


def _jacobian(slope: Array, corners: Array) -> Array:
    """Return ∂x/∂ξ (nc, np, x, ξ) of cells with corners (nc, k, 3), from slopes (np, k, 3) of the linear element."""
    local = corners - corners[:, :1]  # far from the origin the differences would lose digits
    return local.transpose(0, 2, 1)[:, None] @ slope


@cache
def tabulated(element: Element, order: int) -> Tabulated:
    """Tabulate an element at the points of scikit-fem's rule of an order.

    Its rules for tetrahedra are exact up to order 4; those of order 5 to 9 are exact to one less (scikit-fem 12).
    """
    if order == 1:  # the centroid, for which scikit-fem has no rule in hexahedra
        centre = reference_points(element)[: element.corners].mean(axis=0)
        points, weight = centre[:, None], np.array([1 / 6 if element.is_tetrahedron else 1.0])
    else:
        points, weight = get_quadrature(_SKFEM[element].refdom, order)
    value, slope = _evaluate(element, points)
    corner_value, corner_slope = _evaluate(element.linear, points)
    return Tabulated(weight, value, slope, corner_value, corner_slope)


@cache
def reference_points(element: Element) -> Array:
    """Return coordinates (k, 3) of the nodes in the reference cell, in VTK's order."""
    corners = np.array(_TET_CORNERS if element.is_tetrahedron else _HEX_CORNERS, dtype=float)
    points: Array = np.array([corners[list(of)].mean(axis=0) for of in element.node_corners])
    return points


def _evaluate(element: Element, points: Array) -> tuple[Array, Array]:
    """Return values (nq, k) and derivatives (nq, k, 3) at reference points (3, nq), nodes in VTK's order."""
    skfem_element = _SKFEM[element]()
    place = {tuple(point): number for number, point in enumerate(skfem_element.doflocs.tolist())}
    values, slopes = [], []
    for point in reference_points(element).tolist():
        value, slope = skfem_element.lbasis(points.copy(), place[tuple(point)])
        values.append(np.broadcast_to(value, points.shape[1:]))
        slopes.append(np.broadcast_to(np.array([*np.broadcast_arrays(*slope)]), points.shape))
    return np.array(values, dtype=float).T, np.array(slopes, dtype=float).transpose(2, 0, 1)
