"""Elastic solids solved by the elements alone, without contact: meshes by maps of a cube, loads, supports, norms."""

import itertools

import numpy as np
import skfem
from scipy.sparse.linalg import splu
from skfem.quadrature import get_quadrature

from mechanics.stones.elasticity.operators import elastic_operators
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.mesh import SolidMesh, boundary_facets, with_middle_nodes
from mechanics.stones.meshing.shape_functions import integration

ELEMENTS = tuple(Element)
_FACET = {
    Element.TET4: skfem.ElementTriP1,
    Element.TET10: skfem.ElementTriP2,
    Element.HEX8: skfem.ElementQuad1,
    Element.HEX20: skfem.ElementQuadS2,
    Element.HEX27: skfem.ElementQuad2,
}
# the corners of a cube's cells, and the six tetrahedra around its diagonal (Kuhn)
_STEPS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
_KUHN = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))


def grid(element, counts, shape=lambda x: x):
    """A unit cube, cut into counts[i] parts along each axis, under a map of its points (n, 3)."""
    counts = np.array(counts)
    axes = [np.arange(n + 1) / n for n in counts]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    strides = np.array([(counts[1] + 1) * (counts[2] + 1), counts[2] + 1, 1])
    first = np.array(list(itertools.product(*(range(n) for n in counts)))) @ strides
    cells = first[:, None] + _STEPS @ strides
    if element.is_tetrahedron:
        cells = cells[:, _KUHN].reshape(-1, 4)
    return solid(element, shape(nodes), cells)


def solid(element, nodes, cells):
    """The mesh with middle nodes and boundary; all facets are given to one face."""
    facets = boundary_facets(element.linear, cells)
    mesh = SolidMesh(element.linear, nodes, cells, facets, np.zeros(len(facets), dtype=np.int64))
    return mesh if element.order == 1 else with_middle_nodes(mesh, element)


def distorted(amount, seed=0):
    """A map of the unit cube that moves the points inside it, and on its boundary within the boundary."""
    wave = np.random.default_rng(seed).uniform(1.0, 2.0, (3, 3)).round(2)

    def shape(x):
        inside = np.sin(np.pi * x)  # zero on the two sides of each axis
        return x + amount * inside * np.sin(x @ wave * 2.0 + np.arange(3))

    return shape


def shaken(mesh_counts, amount, seed=0):
    """A map that moves the inner points of a grid at random, by a part of its width."""
    rng = np.random.default_rng(seed)
    width = 1.0 / np.array(mesh_counts)

    def shape(x):
        free = (x > 1e-9) & (x < 1 - 1e-9)
        return x + amount * width * free * rng.uniform(-1.0, 1.0, x.shape)

    return shape


def facets_at(mesh, condition):
    """Boundary facets whose corners all satisfy a condition of their places (n, 3)."""
    corners = mesh.facets[:, : mesh.element.facet_corners]
    return mesh.facets[condition(mesh.nodes)[corners].all(axis=1)]


def facet_rule(mesh, facets, order=6):
    """Area weights (ns, nq), shape functions (nq, kf), places and outward normals (ns, nq, 3) on facets."""
    one, linear = _FACET[mesh.element](), _FACET[mesh.element.linear]()
    points, weight = get_quadrature(one.refdom, order)
    ends = np.array(
        [(0, 0), (1, 0), (0, 1)] if mesh.element.is_tetrahedron else [(0, 0), (1, 0), (1, 1), (0, 1)]
    )
    middles = 0.5 * (ends + np.roll(ends, -1, axis=0))
    places = [*ends.tolist(), *middles.tolist(), [0.5, 0.5]][: mesh.element.facet_nodes]
    value = _at(one, points, places)[0]
    corner_value, slope = _at(linear, points, ends.astype(float).tolist())
    corners = mesh.nodes[facets[:, : mesh.element.facet_corners]]
    tangents = np.einsum("qki,skx->sqix", slope, corners)
    normal = np.cross(tangents[:, :, 0], tangents[:, :, 1])
    area = np.linalg.norm(normal, axis=-1)
    return weight * area, value, np.einsum("qk,skx->sqx", corner_value, corners), normal / area[..., None]


def _at(one, points, places):
    number = {tuple(map(float, p)): n for n, p in enumerate(one.doflocs.tolist())}
    found = [one.lbasis(points.copy(), number[tuple(map(float, place))]) for place in places]
    value = np.array([np.broadcast_to(v, points.shape[1:]) for v, _ in found]).T
    slope = np.array([[np.broadcast_to(d, points.shape[1:]) for d in s] for _, s in found])
    return value, slope.transpose(2, 0, 1)


def traction_forces(mesh, facets, traction):
    """Nodal forces (n, 3) of a traction(x, normal) → (…, 3) [Pa] on facets."""
    weight, value, place, normal = facet_rule(mesh, facets)
    force = np.zeros((len(mesh.nodes), 3))
    np.add.at(force, facets, np.einsum("sq,qk,sqx->skx", weight, value, traction(place, normal)))
    return force


def body_forces(mesh, density, order=6):
    """Nodal forces (n, 3) of a force density(x) → (…, 3) [N/m³]."""
    rule = integration(mesh.element, mesh.nodes, mesh.cells, order)
    force = np.zeros((len(mesh.nodes), 3))
    np.add.at(force, mesh.cells, np.einsum("cq,qk,cqx->ckx", rule.volume, rule.value, density(rule.point)))
    return force


def solve(mesh, material, force, held, values=None):
    """Displacement (n, 3) with the dofs of the mask `held` (n, 3) at `values` (n, 3), else zero."""
    stiffness = elastic_operators(mesh, material).stiffness
    found = np.zeros(force.size) if values is None else np.where(held, values, 0.0).ravel()
    free = ~held.ravel()
    right = (force.ravel() - stiffness @ found)[free]
    matrix = stiffness[free][:, free].tocsc()
    found[free] = splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve(right)
    return found.reshape(-1, 3)


def norm(mesh, field, order=6, matrix=None):
    """√∫ f·f, or √∫ f·A f, of field(rule) → (nc, nq, m) at the points of a rule."""
    rule = integration(mesh.element, mesh.nodes, mesh.cells, order)
    f = field(rule)
    product = f if matrix is None else f @ matrix
    return float(np.sqrt(np.einsum("cq,cqi,cqi->", rule.volume, f, product)))


def strain(rule, mesh, displacement):
    """(nc, nq, 6) strains of a nodal displacement at the points of a rule; shears are γ."""
    slope = np.einsum("cqak,cai->cqki", rule.gradient, displacement[mesh.cells])
    both = slope + slope.transpose(0, 1, 3, 2)
    diagonal = [slope[..., i, i] for i in range(3)]
    return np.stack([*diagonal, both[..., 0, 1], both[..., 1, 2], both[..., 2, 0]], axis=-1)


class Waves:
    """A smooth displacement u = Σ a sin(k·x + φ) with its stress and the body force -div σ of a material."""

    def __init__(self, material, count=3, seed=3, reach=2.0):
        rng = np.random.default_rng(seed)
        self.amplitude, self.wave = rng.uniform(-1, 1, (count, 3)), reach * rng.uniform(-1, 1, (count, 3))
        self.phase, self.stiffness = rng.uniform(0, 6, count), material.stiffness

    def displacement(self, x):
        return np.sin(x @ self.wave.T + self.phase) @ self.amplitude

    def stress(self, x):
        slopes = np.einsum("mi,mj->mij", self.amplitude, self.wave)
        return np.cos(x @ self.wave.T + self.phase) @ (_strains(slopes) @ self.stiffness)

    def body_force(self, x):
        stress = _strains(np.einsum("mi,mj->mij", self.amplitude, self.wave)) @ self.stiffness
        tensor = stress[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2]]]
        return np.sin(x @ self.wave.T + self.phase) @ np.einsum("mij,mj->mi", tensor, self.wave)


def _strains(slopes):
    both = slopes + slopes.transpose(0, 2, 1)
    return np.stack(
        [*(slopes[:, i, i] for i in range(3)), both[:, 0, 1], both[:, 1, 2], both[:, 2, 0]], axis=-1
    )
