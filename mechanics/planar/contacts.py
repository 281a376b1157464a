"""Contacts of the plane as a structure of arrays, and their detection."""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array, Bools, Ints
from mechanics.planar._kernels.disks import Disks, GapWatch, find_disks, sort_contacts
from mechanics.planar._kernels.grid import build_grid
from mechanics.planar._kernels.walls import EndNeighbours, end_neighbours, find_walls
from mechanics.planar.model import PlanarModel, PlanarState


@dataclass(frozen=True)
class PlanarContacts:
    """Contact points, by candidate, antagonist and feature.

    The candidate is the disk of the smaller index; the antagonist a disk or a wall. Both material points are the one
    common point in the middle of the gap, so that impulses keep the angular momentum whatever the gap is.

    Attributes
    ----------
    bodies : (nc, 2) candidate and antagonist
    key : (nc,) names the contact from step to step: the bodies, and whether a wall is met on its face or at an end
    normal : (nc, 2) n, from antagonist to candidate; t is n turned by +90°
    gap : (nc,) signed distance, negative when overlapping [m]
    point : (nc, 2) [m]
    lever : (nc, 4) a × n and a × t of the candidate, then of the antagonist; a runs from its centre to the point [m]
    area : (nc,) width of the smaller disk × thickness, as a bond between two disks has it (Potyondy & Cundall 2004);
        against a wall, the width of the disk [m²]
    size : (nc,) width of the smaller disk, tolerances scale with it [m]
    """

    bodies: Ints
    key: Ints
    normal: Array
    gap: Array
    point: Array
    lever: Array
    area: Array
    size: Array

    def __len__(self) -> int:
        return len(self.key)


class PlanarDetector:
    """Contact detection in the plane; the cost is linear in the number of bodies, whatever their sizes.

    Watched are gaps up to the alert distance, plus the reach of the laws, plus what a step can close at the present
    velocities. Where walls share an end, or one ends on another: a disk that meets one of them on its face does not
    meet the other's end; if it meets both only at the end they share, it meets it once.
    """

    def __init__(self, model: PlanarModel) -> None:
        self._model = model
        self._reach = max(law.reach for law in model.laws.laws)
        self._neighbours: EndNeighbours | None = None

    def __call__(
        self, state: PlanarState, ahead: Array | None = None, asked: Bools | None = None
    ) -> PlanarContacts:
        """Find the contacts (nc), in an order that depends on the numbers of the bodies alone.

        `ahead` (nd,) widens the watch by a further distance that each disk may approach anything [m]. Only contacts of
        the disks that are `asked` for (nd,) are found, if it is given.
        """
        model, nd = self._model, len(self._model.radius)
        watch = GapWatch(model.scene.alert_distance, self._reach, model.scene.time.step)
        centre, velocity = state.centre[:nd], state.velocity[:nd]
        # without walls relative to the mean, so that disks that travel together are no harder than disks at rest
        common = np.zeros(2) if len(model.scene.walls) else velocity[:, :2].mean(axis=0)
        pace = np.hypot(velocity[:, 0] - common[0], velocity[:, 1] - common[1])
        ahead = np.zeros(nd) if ahead is None else ahead
        asked = np.ones(nd, dtype=bool) if asked is None else asked
        extent = model.radius * (1 + watch.alert) + watch.reach + watch.step * pace + ahead
        disks = Disks(centre, model.radius, velocity, model.fixed[:nd], ahead, extent, asked)
        grid = build_grid(centre, extent)
        names, values = find_disks(disks, watch, grid)
        if len(model.scene.walls):
            ends = model.ends(state)
            of_walls = find_walls(
                disks, watch, grid, ends, self._wall_speed(state), self._neighbours_of(ends)
            )
            names, values = np.vstack([names, of_walls[0]]), np.vstack([values, of_walls[1]])
        return self._contacts(state, *sort_contacts(names, values, nd))

    def _wall_speed(self, state: PlanarState) -> Array:
        """Return the largest speed of a point of each wall (nw,) [m/s]."""
        velocity = state.velocity[len(self._model.radius) :]
        turning = np.abs(velocity[:, 2]) * np.hypot(self._model.half[:, 0], self._model.half[:, 1])
        return np.asarray(np.hypot(velocity[:, 0], velocity[:, 1]) + turning)

    def _neighbours_of(self, ends: Array) -> EndNeighbours:
        """Find the walls that share ends, again only where walls move."""
        if self._neighbours is None or self._model.walls_move:
            self._neighbours = end_neighbours(ends)
        return self._neighbours

    def _contacts(self, state: PlanarState, names: Ints, values: Array) -> PlanarContacts:
        radius, nd = self._model.radius, len(self._model.radius)
        bodies = np.ascontiguousarray(names[:, :2])
        normal, gap = np.ascontiguousarray(values[:, :2]), values[:, 2].copy()
        first, second = bodies.T
        on_wall = second >= nd
        to_point = radius[first] + 0.5 * gap
        point = state.centre[first] - to_point[:, None] * normal
        arm = point - state.centre[second]
        second_radius = radius[np.where(on_wall, 0, second)]
        lever = np.zeros((len(gap), 4))
        # of a disk the arm runs along n exactly
        lever[:, 1] = -to_point
        lever[:, 2] = np.where(on_wall, arm[:, 0] * normal[:, 1] - arm[:, 1] * normal[:, 0], 0.0)
        along = arm[:, 0] * normal[:, 0] + arm[:, 1] * normal[:, 1]
        lever[:, 3] = np.where(on_wall, along, second_radius + 0.5 * gap)
        # what pushes a wall with a mass does not turn it
        lever[~self._model.fixed[second] & on_wall, 2:] = 0.0
        size = 2.0 * np.where(on_wall, radius[first], np.minimum(radius[first], second_radius))
        key = (first * len(self._model.fixed) + second) * 3 + names[:, 2]
        return PlanarContacts(
            bodies, key, normal, gap, point, lever, size * self._model.scene.thickness, size
        )
