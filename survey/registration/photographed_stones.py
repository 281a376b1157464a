"""Stones measured on a photograph: their corners lifted to the plane of their neighbours.

The homography of the photograph (`survey.registration.marked_walls`) maps the corners to the plane of the marks. The
plane of the face itself is predicted from its neighbours (`survey.faces.common_planes`); with too few of these, from
all faces of the wall; otherwise it is that of the marks. Points measured on the face correct the prediction. From the
plane of the marks the corners move to the face along the line of sight, so that it covers in space what it covers on
the photograph; where the station is not known they move square to the marks' plane, which is exact for a perpendicular
line of sight.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ground.errors import GeometryError, MomaError, SurveyError
from survey.arrays import Array
from survey.conventions import CRITICAL, LEAST, PARALLEL, TENTH, VANISHING
from survey.faces.common_planes import CommonPlane, PlaneEstimate, common_plane
from survey.faces.neighbours import MeasuredFace, Neighbours
from survey.faces.planes import FaceFit, fit_plane
from survey.records.survey import BlockRecord, Photograph, SurveyHead
from survey.registration.marked_walls import OFF_SQUARE, MarkedWall, wall_of_marks

_COARSEST = TENTH  # largest standard deviation of a corner over the size of the stone
_GRAZING = math.sin(PARALLEL)  # flattest useful line of sight


@dataclass(frozen=True)
class LiftedFace:
    """The outline in space of a stone that was measured on a photograph.

    Attributes
    ----------
    outline : (nv, 3) corners in the order of the record, on the plane [m]
    fit : the plane, with its predicted covariance. Where points measured on the face determine it alone, it is their
        fit, with residuals. Otherwise it has none: `rms` is the standard deviation of the heights of the
        neighbours about their plane, `redundancy` 0 and `sigma0` nan
    sigma : (nv,) standard deviation of each corner in the plane, along any direction [m]
    text : origin of the plane, e.g. "photograph P1, in the plane of W01-02, W01-03 and W02-01"
    """

    outline: Array
    fit: FaceFit
    sigma: Array
    text: str


def lift_faces(
    records: Sequence[BlockRecord],
    photographs: Sequence[Photograph],
    faces: Sequence[MeasuredFace],
    head: SurveyHead,
) -> Iterator[tuple[BlockRecord, LiftedFace | MomaError]]:
    """Lift stones that were measured on photographs, in order; a stone that cannot be lifted comes with its error.

    Parameters
    ----------
    records : stones measured on a photograph
    photographs : of the survey
    faces : measured in space, of the whole survey
    head : of the survey, with the stations that photographs were taken from
    """
    neighbours = Neighbours(faces)
    known = {photograph.name: photograph for photograph in photographs}
    walls: dict[str, tuple[MarkedWall, CommonPlane | None] | MomaError] = {}
    for record in records:
        name = record.photograph or ""
        if name not in walls:
            walls[name] = _wall(name, known, neighbours, head)
        wall = walls[name]
        try:
            if isinstance(wall, MomaError):
                raise wall
            yield record, lift(record, wall[0], neighbours, wall[1])
        except MomaError as error:
            place = f"stone {record.code} (line {record.line})"
            yield record, error.at(place if error.where is None else f"{place}, {error.where}")


def lift(
    record: BlockRecord, wall: MarkedWall, neighbours: Neighbours, whole: CommonPlane | None = None
) -> LiftedFace:
    """Lift the corners of one stone from a photograph into space.

    Parameters
    ----------
    record : with its corners on the photograph, in `image`
    wall : the photograph and the plane of its marks
    neighbours : faces measured in space
    whole : plane used where fewer than three neighbours are near, see `plane_of_wall`; None: that of the marks

    Raises
    ------
    GeometryError
        if a corner lies far outside the marks, is seen at a grazing angle, or has a standard deviation over a tenth
        of the size of the stone
    """
    if len(record.image) < 3:
        raise GeometryError(
            f"it has {len(record.image)} corners on the photograph", remedy="measure 3 or more"
        )
    on_marks, covariances = wall.on_plane(record.image)
    if _size(on_marks) < LEAST:
        raise GeometryError("its corners on the photograph coincide", remedy="measure them again")
    fit, plane = _face_plane(record, _predicted(on_marks, wall, neighbours, whole), on_marks, wall)
    outline, sigma = _moved(on_marks, covariances, wall, plane)
    size = _size(outline)
    if not sigma.max() <= _COARSEST * size:
        raise GeometryError(
            f"corner {int(np.argmax(sigma)) + 1} is known to {sigma.max():.3f} m only, of a stone of {size:.2f} m",
            where=f"photograph {wall.name}",
            remedy="add marks around the stone, or measure the stone in space",
        )
    return LiftedFace(outline, fit or _as_fit(plane, outline), sigma, f"photograph {wall.name}, {plane.text}")


def plane_of_wall(wall: MarkedWall, neighbours: Neighbours) -> CommonPlane | None:
    """Fit the common plane of all faces on the wall of a photograph that face its way; None without three."""
    indices = neighbours.on_wall(wall.fit.centroid, wall.fit.normal, wall.relief)
    if not len(indices):
        return None
    return common_plane(neighbours.fits(indices), wall.fit.centroid)


def _wall(
    name: str, photographs: dict[str, Photograph], neighbours: Neighbours, head: SurveyHead
) -> tuple[MarkedWall, CommonPlane | None] | MomaError:
    if name not in photographs:
        return SurveyError(
            f"no photograph {name!r}",
            remedy=f"photographs of this survey: {', '.join(photographs) or 'none'}",
        )
    photograph = photographs[name]
    try:
        viewpoint = None if photograph.station is None else head.viewpoint(photograph.station)
        wall = wall_of_marks(photograph, viewpoint, head.viewpoint(None))
    except MomaError as error:
        return error
    if viewpoint is None and head.viewpoint(None) is None:
        wall = wall.facing(neighbours.outward(wall.fit.centroid, wall.fit.normal, wall.relief))
    return wall, plane_of_wall(wall, neighbours)


def _predicted(
    on_marks: Array, wall: MarkedWall, neighbours: Neighbours, whole: CommonPlane | None
) -> PlaneEstimate:
    """Predict the plane of one face from its neighbours, otherwise from the wall, otherwise from the marks."""
    place = on_marks.mean(axis=0)
    close = neighbours.near(on_marks, wall.fit.normal)
    if len(close):
        plane = common_plane(neighbours.fits(close), place)
        names = [neighbours.codes[i] for i in close[list(plane.members)]]
        return plane.face_at(place, f"in the plane of {_listed(names)}")
    if whole is not None:
        return whole.face_at(place, f"in the plane of the wall ({len(whole.members)} faces)")
    fit = wall.fit
    used = len(fit.residuals) - len(fit.rejected)
    scatter = fit.rms * float(np.sqrt(used / max(fit.redundancy, 1)))
    # no tilts are known: assume that corners and middles of faces scatter alike
    reach = 0.5 * _size(on_marks)
    marks = CommonPlane(fit.centroid, fit.normal, fit.axes, fit.covariance, scatter, scatter / reach)
    return marks.face_at(place, "in the plane of its marks")


def _face_plane(
    record: BlockRecord, plane: PlaneEstimate, on_marks: Array, wall: MarkedWall
) -> tuple[FaceFit | None, PlaneEstimate]:
    """Return the plane fitted to points on the face, or the predicted one corrected by them."""
    count = len(record.points)
    if count == 0:
        return None, plane
    words = f"{count} point{'s' if count > 1 else ''} measured on it"
    sigmas = record.point_sigmas
    sound = np.ones(count, dtype=bool)
    if count >= 3:
        try:
            fit = fit_plane(record.points, sigmas, record.points[0] + 1e3 * wall.fit.normal)
        except GeometryError:
            pass  # for example points on a line, which still correct the prediction
        else:
            if fit.height_sigma(on_marks).max() <= plane.height_sigma(on_marks).max():
                return fit, PlaneEstimate(
                    fit.centroid, fit.normal, fit.axes, fit.covariance, fit.rms, f"in the plane of {words}"
                )
            sound[list(fit.rejected)] = False
    points, sigmas = record.points[sound], sigmas[sound]
    remarks = [f"{plane.text}, corrected by {words}"]
    if not sound.all():
        remarks.append(f"{count - len(points)} of them left out")
    # the stone may stand out, so its own points outweigh its surroundings
    heights = (points - plane.centroid) @ plane.normal
    tests = np.abs(heights) / np.hypot(plane.height_sigma(points), sigmas)
    if tests.max() > CRITICAL:
        remarks.append(
            f"which lie up to {np.abs(heights).max() * 1e3:.0f} mm off ({tests.max():.1f} standard deviations)"
        )
    return None, plane.corrected(points, sigmas, ", ".join(remarks))


def _moved(
    on_marks: Array, covariances: Array, wall: MarkedWall, plane: PlaneEstimate
) -> tuple[Array, Array]:
    """Move corners onto the face's plane, (nv, 3); return the standard deviation of each in it too, (nv,) [m]."""
    down = (on_marks - plane.centroid) @ plane.normal
    rays = (
        np.tile(-wall.fit.normal, (len(on_marks), 1)) if wall.viewpoint is None else on_marks - wall.viewpoint
    )
    slant = rays @ plane.normal
    if not (-slant > _GRAZING * np.linalg.norm(rays, axis=1)).all():
        raise GeometryError(
            "its plane is seen at less than 10°, or from behind",
            where=f"photograph {wall.name}",
            remedy="measure the stone in space",
        )
    per_height = rays / slant[:, None]  # movement of a corner as the plane rises by 1 m
    corners = on_marks - per_height * down[:, None]
    scale = 1.0 if wall.viewpoint is None else 1.0 - down / slant
    # Jacobian of corners with respect to their coordinates on the marker plane, in the axes of either plane
    follow = plane.axes @ (np.eye(3) - per_height[:, :, None] * plane.normal) @ wall.fit.axes.T
    own = scale * scale * np.trace(follow @ covariances @ follow.transpose(0, 2, 1), axis1=1, axis2=2)
    height = plane.height_sigma(corners) ** 2
    variance = 0.5 * (own + height * ((per_height @ plane.axes.T) ** 2).sum(axis=1))
    if wall.viewpoint is None:
        variance = variance + (down**2 + height) * OFF_SQUARE**2
    return corners, np.sqrt(variance)


def _as_fit(plane: PlaneEstimate, outline: Array) -> FaceFit:
    """Express a predicted plane as a fit, about the place where its height does not depend on its tilts."""
    tilts, directions = np.linalg.eigh(plane.covariance[:2, :2])
    axes, tilts = directions.T @ plane.axes, np.maximum(tilts, VANISHING**2)
    # limit correlations to 1 where a variance is rounding alone
    most = np.sqrt(tilts * plane.covariance[2, 2])
    across = np.clip(directions.T @ plane.covariance[:2, 2], -most, most)
    # smallest spread of the tilts first, as the axis along which a measured face is longest
    centroid = plane.centroid - (across / tilts) @ axes
    height = max(plane.covariance[2, 2] - float((across**2 / tilts).sum()), VANISHING**2)
    return FaceFit(
        normal=plane.normal,
        offset=float(plane.normal @ centroid),
        centroid=centroid,
        axes=axes,
        singular_values=np.linalg.svd(outline - outline.mean(axis=0), compute_uv=False),
        covariance=np.diag([*tilts, height]),
        rms=plane.scatter,
        sigma0=float("nan"),
        redundancy=0,
        rejected=(),
        residuals=np.empty(0),
        standardised=np.empty(0),
    )


def _size(outline: Array) -> float:
    """Return the largest distance between two corners [m]."""
    return float(np.linalg.norm(outline[:, None] - outline[None], axis=2).max())


def _listed(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
