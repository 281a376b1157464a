"""Simplification of imported solids: a hexahedron, wedge or prism if they are one within rounding, else general."""

import numpy as np

from ground.errors import GeometryError
from survey.arrays import Array
from survey.conventions import EPSILON, VANISHING
from survey.extrusion.extrusion import SurveyedBlock, prism
from survey.geometry.folds import fold, warp
from survey.geometry.plane_network import settle
from survey.geometry.solids import Solid, highest_corner
from survey.simplify.blockiness import (
    about,
    common_share,
    largest_skew,
    moved_corners,
    solid_planes,
    solid_volume,
)
from survey.simplify.flattening import FlatSolid, flatten, unfold
from survey.simplify.result import BlockShape, SimpleSolid, Simplified, prism_shape
from survey.simplify.squaring import SimplifyBounds

_PLANE = 5e-9  # metres: warp of a planar face due to rounding in a national grid


def simplify_solid(block: SurveyedBlock, bounds: SimplifyBounds) -> SimpleSolid:
    """Simplify an imported solid; see `survey.simplify.simplify.simplify`."""
    origin = block.solid.vertices.mean(axis=0)
    old, tolerance = about(block.solid, origin), bounds.least_tolerance
    _check_full(old)
    flat = flatten(old, tolerance)
    if flat is None:
        flat = unfold(old)
    new = None if flat is None else _prism(flat.solid, block.face.fit.normal, block.face.outline[0] - origin)
    if flat is not None and new is not None:
        shape, reason = prism_shape(len(new.faces) - 2), _describe(old, new, flat)
    elif flat is not None and flat.moved.max() > tolerance:
        shape, new = BlockShape.POLYHEDRON, flat.solid
        reason = _describe(old, new, flat)
    else:
        shape, new = BlockShape.POLYHEDRON, _general(old, tolerance)
        reason = _why_general(old, new)
    same = new is old
    if flat is None or shape is BlockShape.POLYHEDRON:
        left = np.linalg.norm(new.vertices - old.vertices, axis=1)
    else:
        left = flat.moved
    hexahedron = new if shape is BlockShape.HEXAHEDRON else _box_around(old, block.face.fit.normal)
    report = Simplified(
        displacement=left if same else moved_corners(old, new, left),
        volume_change=0.0 if same else solid_volume(new) / solid_volume(old) - 1.0,
        worst_angle=largest_skew(new),
        blockiness=common_share(old, hexahedron),
        tolerance=tolerance,
        within=bool((left <= tolerance).all()),
        reason=reason,
    )
    solid = block.solid if same else _placed(new, old, block.solid)
    return SimpleSolid(solid, np.ones(len(solid.vertices), dtype=np.bool_), shape, report)


def _check_full(solid: Solid) -> None:
    volume = solid_volume(solid)
    if not volume > EPSILON * _size(solid) ** 3:
        raise GeometryError(
            f"its faces enclose {volume:.3g} m³: it is flat, or seen from inside",
            where=f"stone {solid.code}",
            remedy="check its corners and their order in each face",
        )


def _prism(solid: Solid, outward: Array, first: Array) -> Solid | None:
    """Return the solid as a convex prism, its visible corners first; None if it is not one."""
    return _as_prism(solid, outward, first) if highest_corner(solid) <= VANISHING * _size(solid) else None


def _general(old: Solid, tolerance: float) -> Solid:
    """Return a general solid with planar faces: its corners are moved as little as possible, or faces are folded."""
    if _is_plane(old):
        return old
    settled = _settled(_folded(old, tolerance))
    moved = float(np.linalg.norm(settled.vertices - old.vertices, axis=1).max())
    return settled if moved <= tolerance and _is_plane(settled) else _folded(old, _PLANE)


def _settled(solid: Solid) -> Solid:
    """Return the solid with its corners moved onto the planes of its faces."""
    ties = [(i, k) for k, face in enumerate(face for face in solid.faces if len(face) > 3) for i in face]
    if not ties:
        return solid
    corner, plane = np.array(ties, dtype=np.int64).T
    return Solid(solid.code, settle(solid.vertices, corner, plane).vertices, solid.faces)


def _folded(solid: Solid, tolerance: float) -> Solid:
    faces = tuple(part for face in solid.faces for part in fold(solid.vertices, face, tolerance))
    return Solid(solid.code, solid.vertices, faces)


def _is_plane(solid: Solid) -> bool:
    return all(warp(solid.vertices[list(face)]) <= _PLANE for face in solid.faces)


def _size(solid: Solid) -> float:
    return float(np.ptp(solid.vertices, axis=0).max())


def _describe(old: Solid, new: Solid, flat: FlatSolid) -> str:
    words = [f"{len(new.faces)} plane faces"]
    if len(old.faces) > len(new.faces):
        words.append(f"{len(old.faces)} faces lie in their planes, or were folded from them")
    if flat.moved.max() > 0.0:
        words.append(f"corners moved by up to {flat.moved.max() * 1e3:.2g} mm to make them plane")
    return "; ".join(words)


def _why_general(old: Solid, new: Solid) -> str:
    """Return the reasons why a solid stays general."""
    words = [f"stays general, with {len(new.faces)} faces"]
    if (rise := highest_corner(new)) > VANISHING * _size(old):
        words.append(f"not convex, a corner stands {rise * 1e3:.2g} mm above the plane of a face")
    else:
        words.append("convex, but no prism of which three planes meet in each corner")
    if len(new.faces) > len(old.faces):
        words.append(f"folded from {len(old.faces)} that are not plane")
    if (moved := float(np.linalg.norm(new.vertices - old.vertices, axis=1).max())) > 0.0:
        words.append(f"corners moved by up to {moved * 1e3:.2g} mm to make them plane")
    return "; ".join(words)


def _placed(new: Solid, old: Solid, world: Solid) -> Solid:
    """Move a solid back from the origin; corners that were not moved keep their last bits."""
    origin = world.vertices.mean(axis=0)
    apart = np.abs(new.vertices[:, None, :] - old.vertices).max(axis=2)
    same, nearest = apart.min(axis=1) == 0.0, apart.argmin(axis=1)
    vertices = np.where(same[:, None], world.vertices[nearest], new.vertices + origin)
    return Solid(world.code, vertices, new.faces)


def _as_prism(solid: Solid, outward: Array, first: Array) -> Solid | None:
    """Return the solid with the corners of one end first, then those behind them; None if it is no prism.

    A prism here has two ends of n corners and n faces of four corners between them; its ends need not be parallel.

    Parameters
    ----------
    solid : closed, its faces plane
    outward : (3,) normal of the visible face; the end whose normal is nearest to it comes first
    first : (3,) the corner nearest to this point comes first [m]
    """
    count = len(solid.faces) - 2
    ends = [k for k, face in enumerate(solid.faces) if len(face) == count]
    if len(solid.vertices) != 2 * count or sum(len(face) == 4 for face in solid.faces) < count:
        return None
    if len(ends) < 2 or (count != 4 and set(solid.faces[ends[0]]) & set(solid.faces[ends[1]])):
        return None
    towards = solid_planes(solid)[ends, :3] @ outward
    front = solid.faces[ends[int(towards.argmax())]]
    behind = {a: b for face in solid.faces for a, b in _both_ways(face) if a in front and b not in front}
    if len(set(behind.values())) != count:
        return None
    start = int(np.linalg.norm(solid.vertices[list(front)] - first, axis=1).argmin())
    visible = list(front[start:] + front[:start])
    return prism(solid.code, solid.vertices[visible], solid.vertices[[behind[i] for i in visible]])


def _both_ways(face: tuple[int, ...]) -> list[tuple[int, int]]:
    edges = [(face[k - 1], face[k]) for k in range(len(face))]
    return edges + [(b, a) for a, b in edges]


def _box_around(solid: Solid, outward: Array) -> Solid:
    """Return the smallest box around a solid with sides parallel to its visible face and one of the face's edges.

    Parameters
    ----------
    solid : closed
    outward : (3,) unit normal of the visible face [-]
    """
    ends = np.array([edge for face in solid.faces for edge in zip(face, face[1:] + face[:1], strict=True)])
    along = solid.vertices[ends[:, 1]] - solid.vertices[ends[:, 0]]
    along -= np.outer(along @ outward, outward)
    lengths = np.linalg.norm(along, axis=1)
    along = along[lengths > 1e-6 * lengths.max()] / lengths[lengths > 1e-6 * lengths.max(), None]
    across = np.cross(outward, along)
    areas = np.ptp(solid.vertices @ along.T, axis=0) * np.ptp(solid.vertices @ across.T, axis=0)
    best = int(areas.argmin())
    axes = np.array([along[best], across[best], outward])
    placed = solid.vertices @ axes.T
    (x0, y0, z0), (x1, y1, z1) = placed.min(axis=0), placed.max(axis=0)
    front = np.array([(x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)])
    return prism(solid.code, front @ axes, (front - [0.0, 0.0, z1 - z0]) @ axes)
