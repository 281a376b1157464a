"""Stones that came as closed solids: hexahedra, wedges and prisms where they are so but for rounding, else general."""

import numpy as np
from numpy.typing import NDArray

from moma.errors import GeometryError
from survey.blockiness import about, common_share, largest_skew, moved_corners, solid_planes, solid_volume
from survey.extrusion import SurveyedBlock
from survey.flattening import FlatSolid, flatten, highest_corner, is_plane, split_bent_faces
from survey.prisms import as_prism, box_around
from survey.simplified import BlockShape, SimpleSolid, Simplified, prism_shape
from survey.solids import Solid
from survey.squaring import SimplifyBounds
from survey.watertight import triangulate

__all__ = ["simplify_solid"]

Array = NDArray[np.float64]

_EQUAL = 1e-12  # of a stone's size: a corner nearer to a plane than that is on it
_CONVEX = 1e-10  # of a stone's size: a corner above a face by less is on it
_FLAT = 1e-12  # of the cube on a stone's length: a solid that encloses less is flat


def simplify_solid(block: SurveyedBlock, bounds: SimplifyBounds) -> SimpleSolid:
    """Simplify a stone that came as a solid; see `survey.blocky.simplify`."""
    origin = block.solid.vertices.mean(axis=0)
    old, tolerance = about(block.solid, origin), bounds.least_tolerance
    _check_full(old)
    found = flatten(old, tolerance)
    new = (
        None if found is None else _prism(found.solid, block.face.fit.normal, block.face.outline[0] - origin)
    )
    if found is not None and new is not None:
        shape, reason = prism_shape(len(new.faces) - 2), _said(old, new, found)
    else:
        shape, reason = BlockShape.POLYHEDRON, _why_general(old, found, tolerance)
        new = _general(old, found)
    same = new is old
    left = np.zeros(len(old.vertices)) if same or found is None else found.moved
    hexahedron = new if shape is BlockShape.HEXAHEDRON else box_around(old, block.face.fit.normal)
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
    if not volume > _FLAT * _size(solid) ** 3:
        raise GeometryError(
            f"its faces enclose {volume:.3g} m³: it is flat, or seen from inside",
            where=f"stone {solid.code}",
            remedy="look at its corners and at the order of those of each face",
        )


def _prism(solid: Solid, outward: Array, first: Array) -> Solid | None:
    """The solid as a convex prism, its visible corners first; None if it is none."""
    return as_prism(solid, outward, first) if _rise(solid) <= _CONVEX * _size(solid) else None


def _general(old: Solid, found: FlatSolid | None) -> Solid:
    """A solid that is no prism, with plane faces."""
    plane = _EQUAL * _size(old)
    if is_plane(old, plane):
        return old
    return split_bent_faces(old, triangulate(old).tolist(), plane) if found is None else found.solid


def _rise(solid: Solid) -> float:
    return highest_corner(solid, solid_planes(solid))


def _size(solid: Solid) -> float:
    return float(np.ptp(solid.vertices, axis=0).max())


def _said(old: Solid, new: Solid, found: FlatSolid) -> str:
    said = [f"{len(new.faces)} plane faces"]
    if len(old.faces) > len(new.faces):
        said.append(f"{len(old.faces)} faces lie in their planes")
    if found.moved.max() > 0.0:
        said.append(f"corners moved by up to {found.moved.max() * 1e3:.2g} mm to make them plane")
    return "; ".join(said)


def _why_general(old: Solid, found: FlatSolid | None, tolerance: float) -> str:
    """Why a solid stays general, in words."""
    if found is None:
        return (
            f"kept as it was made: its {len(old.faces)} faces are no planes within {tolerance * 1e3:.2g} mm of which "
            "three meet in each corner"
        )
    if (rise := _rise(found.solid)) > _CONVEX * _size(old):
        return f"kept as it was made: not convex, a corner stands {rise * 1e3:.2g} mm above a face"
    return f"kept as it was made: its {len(found.solid.faces)} faces are those of no prism"


def _placed(new: Solid, old: Solid, world: Solid) -> Solid:
    """A solid about the origin put where it belongs; corners that did not move keep their last bits."""
    origin = world.vertices.mean(axis=0)
    apart = np.abs(new.vertices[:, None, :] - old.vertices).max(axis=2)
    same, nearest = apart.min(axis=1) == 0.0, apart.argmin(axis=1)
    vertices = np.where(same[:, None], world.vertices[nearest], new.vertices + origin)
    return Solid(world.code, vertices, new.faces)
