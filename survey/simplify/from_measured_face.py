"""Simplification of measured stones: a hexahedron, wedge or prism on as few corners of the face as are justified."""

import numpy as np

from ground.errors import GeometryError
from survey.arrays import Array, Bools
from survey.conventions import EPSILON, TOUCHING
from survey.extrusion.extrusion import SurveyedBlock, hidden_side, prism
from survey.geometry.solids import Solid
from survey.simplify.blockiness import (
    about,
    common_share,
    from_edges,
    largest_skew,
    moved_corners,
    solid_volume,
)
from survey.simplify.result import BlockShape, SimpleSolid, Simplified, prism_shape
from survey.simplify.squaring import SimplifyBounds, SquaredFace, nearest_quadrilateral, square_face
from survey.simplify.worn_corners import restore_worn


def simplify_face(block: SurveyedBlock, bounds: SimplifyBounds) -> SimpleSolid:
    """Simplify a stone whose face was measured; see `survey.simplify.simplify.simplify`.

    A face with a corner too deep inside the outline of the others stays as surveyed.
    """
    fit = block.face.fit
    axes = np.array([fit.axes[0], np.cross(fit.normal, fit.axes[0])])
    flat = (block.face.outline - fit.centroid) @ axes.T
    worn = np.zeros(len(flat), dtype=np.bool_)
    worn[list(block.face.rejected_vertices)] = True
    tolerance = _tolerance(block, bounds)
    squared = square_face(flat, worn, tolerance, bounds)
    _check_flat(block, squared)
    if squared.dent > 0.0:
        solid, sound, shape = block.solid, ~worn, BlockShape.POLYHEDRON
        reason = (
            f"kept as surveyed: a corner lies {squared.dent * 1e3:.0f} mm inside the outline of the others"
        )
    else:
        points = np.delete(block.face.record.points, list(block.face.rejected_points), axis=0)
        farthest = min(bounds.max_restored, bounds.restored_share * squared.width)
        squared, count = restore_worn(squared, worn, (points - fit.centroid) @ axes.T, tolerance, farthest)
        solid, shape = _extruded(block, squared, axes), prism_shape(len(squared.corners))
        # restored corners are as accurate as sound ones
        sound = (squared.source < 0) | ~worn[squared.source]
        reason = _describe(squared, worn, count)
    old, new = about(block.solid, fit.centroid), about(solid, fit.centroid)
    same = solid is block.solid
    left = np.zeros(len(old.vertices)) if same else from_edges(old.vertices, new)
    if shape is not BlockShape.HEXAHEDRON:
        share = common_share(old, _nearest_hexahedron(block, flat, axes))
    else:
        share = 1.0 if same else common_share(old, new)
    report = Simplified(
        displacement=left if same else moved_corners(old, new, left),
        volume_change=0.0 if same else solid_volume(new) / solid_volume(old) - 1.0,
        worst_angle=largest_skew(new),
        blockiness=share,
        tolerance=tolerance,
        within=bool((left[: len(worn)][~worn] <= tolerance).all()),
        reason=reason,
    )
    return SimpleSolid(solid, sound, shape, report)


def _tolerance(block: SurveyedBlock, bounds: SimplifyBounds) -> float:
    """Return the survey's resolution on this face: three standard deviations of a coordinate [m]."""
    # of a corner's three variances, two lie in the face, where it was measured; the plane's own is small
    variances = 0.5 * (block.vertex_sigma[: len(block.face.outline)] ** 2).sum(axis=1)
    known = [*np.sqrt(variances).tolist(), block.face.fit.rms]
    return float(
        max([bounds.least_tolerance, *(3.0 * deviation for deviation in known if np.isfinite(deviation))])
    )


def _check_flat(block: SurveyedBlock, squared: SquaredFace) -> None:
    where, count = f"stone {block.code}", len(squared.corners)
    if count < 3:
        raise GeometryError(
            f"the convex outline of its face has {count} corners, which enclose no area",
            where=where,
            remedy="measure 3 corners or more that are not on one line",
        )
    length = float(np.ptp(squared.corners, axis=0).max())
    if not min(squared.width, block.depth.value) > TOUCHING * max(length, 1.0):
        raise GeometryError(
            f"it is flat: its face is {squared.width * 1e3:.2g} mm wide, its depth {block.depth.value * 1e3:.2g} mm",
            where=where,
            remedy="check the corners of its face and its depth",
        )


def _extruded(block: SurveyedBlock, squared: SquaredFace, axes: Array) -> Solid:
    """Return the solid behind the squared face; that of the block itself if nothing has changed."""
    fit, outline = block.face.fit, block.face.outline
    restored = fit.centroid + squared.corners @ axes
    corners = np.where(squared.source[:, None] < 0, restored, outline[squared.source])
    corners = corners - np.outer((corners - fit.centroid) @ fit.normal, fit.normal)
    hidden = hidden_side(corners, fit.normal, block.depth.value, block.extrusion)
    solid = prism(block.code, corners, hidden)
    if solid.faces == block.solid.faces:
        size = float(np.ptp(solid.vertices, axis=0).max())
        nearest = np.spacing(
            np.abs(solid.vertices).max()
        )  # what rounding leaves of places far from the origin
        if np.abs(solid.vertices - block.solid.vertices).max() <= EPSILON * size + 4.0 * nearest:
            return block.solid
    return solid


def _nearest_hexahedron(block: SurveyedBlock, flat: Array, axes: Array) -> Solid:
    """Return the hexahedron on the quadrilateral of the face without bounds, about the middle of the face."""
    fit, tail = block.face.fit, block.extrusion.tail
    corners = nearest_quadrilateral(flat) @ axes
    hidden = hidden_side(corners, fit.normal, block.depth.value, block.extrusion)
    # its sides taper towards the same point as those of the stone
    hidden += (1.0 - tail) * (flat.mean(axis=0) @ axes - corners.mean(axis=0))
    return prism(block.code, corners, hidden)


def _describe(squared: SquaredFace, worn: Bools, along_points: int) -> str:
    """Describe the changes of a measured face."""
    count, restored = len(squared.corners), int((squared.source < 0).sum())
    left_out = len(worn) - (count - restored) - along_points
    words = [{3: "a triangular face", 4: "a face of four corners"}.get(count, f"a face of {count} corners")]
    if left_out:
        words.append(f"{left_out} of {len(worn)} measured corners left out")
    if restored > along_points:
        words.append(f"{restored - along_points} restored where the sides beside a bevel or a break meet")
    if along_points:
        words.append(f"{along_points} worn, restored along the points measured beside its sides")
    if count > 4:
        words.append("four would lie too far from those that were measured")
    return "; ".join(words)
