"""One time step of the plane: fly, kick, fly (docs/theory.md §2).

Bodies fly for h (1-θ); there contacts are found and the impulses h P + H r are given; then they fly for hθ. In the
plane this is the θ-scheme q_new = q + h [θ v_new + (1-θ) v] to the last bit of arithmetic. A driven wall is at its
place at each of these instants. The velocity with which it meets the disks is its mean velocity from this kick to the
next: what it pushes flies at constant velocity between two kicks, so it is on the wall again at the next one, and does
not sink in, bit by bit, where the wall speeds up.
"""

from dataclasses import replace

import numpy as np

from ground.errors import SceneError
from mechanics.arrays import Array, Ints
from mechanics.planar.model import PlanarModel, PlanarState
from mechanics.scene.loads.load import Motion


class Drive:
    """The imposed motions of a scene.

    Attributes
    ----------
    bodies : (n,) bodies that are driven
    """

    def __init__(self, model: PlanarModel, start: PlanarState) -> None:
        place = {code: b for b, code in enumerate(model.scene.codes)}
        self._motions: list[tuple[Motion, Ints]] = [
            (motion, np.array(sorted(place[code] for code in motion.stones), dtype=np.int64))
            for motion in model.scene.loads.motions
        ]
        self._start, self._name = start, model.scene.name
        groups = [bodies for _, bodies in self._motions]
        self.bodies: Ints = np.concatenate(groups) if groups else np.zeros(0, dtype=np.int64)

    def place(self, state: PlanarState) -> PlanarState:
        """Return `state` with the driven bodies where they are at its time."""
        if not self._motions:
            return state
        centre, angle = state.centre.copy(), state.angle.copy()
        for motion, bodies in self._motions:
            pose = motion.pose(state.time)
            turn, pivot = pose.rotation[:2, :2], pose.pivot[:2]
            flat = abs(pose.rotation[2, 2] - 1.0) < 1e-12 and abs(pose.displacement[2]) == 0.0
            if not flat:
                raise SceneError(
                    f"a motion leaves the plane at t = {state.time:.6g} s",
                    where=self._name,
                    remedy="let it turn about z and move along x and y",
                )
            start = self._start
            centre[bodies] = pivot + (start.centre[bodies] - pivot) @ turn.T + pose.displacement[:2]
            angle[bodies] = start.angle[bodies] + np.arctan2(turn[1, 0], turn[0, 0])
        return replace(state, centre=centre, angle=angle)

    def velocity(self, now: PlanarState, duration: float) -> Array:
        """Return the mean velocities (n, 3) of the driven bodies from `now`, where they are placed, for `duration`."""
        later = self.place(replace(now, time=now.time + duration))
        turned = later.angle[self.bodies] - now.angle[self.bodies]
        return (
            np.column_stack(
                [
                    later.centre[self.bodies] - now.centre[self.bodies],
                    # the smaller of the two turns that lead there
                    np.remainder(turned + np.pi, 2 * np.pi) - np.pi,
                ]
            )
            / duration
        )


def fly(state: PlanarState, duration: float) -> PlanarState:
    """Move every body on at its velocity."""
    return PlanarState(
        state.time + duration,
        state.centre + duration * state.velocity[:, :2],
        state.angle + duration * state.velocity[:, 2],
        state.velocity,
    )


def space(state: PlanarState, bodies: Ints) -> tuple[Array, Array]:
    """Return centres (n, 3) and rotations (n, 3, 3) in the space whose plane z = 0 this is."""
    co, si = np.cos(state.angle[bodies]), np.sin(state.angle[bodies])
    rotation = np.zeros((len(bodies), 3, 3))
    rotation[:, 0, 0] = rotation[:, 1, 1] = co
    rotation[:, 1, 0], rotation[:, 0, 1] = si, -si
    rotation[:, 2, 2] = 1.0
    return np.column_stack([state.centre[bodies], np.zeros(len(bodies))]), rotation


def load_velocity(model: PlanarModel, state: PlanarState, step: float) -> Array:
    """Compute M⁻¹ h P (nb, 3), by which gravity and forces at the instant of the kick change the velocities."""
    scene, loads = model.scene, model.scene.loads
    gravity = np.array([*scene.gravity, 0.0])
    for change in loads.gravity:
        gravity = np.asarray(change(state.time, gravity), dtype=float)
    gained = np.zeros((len(model.fixed), 3))
    gained[~model.fixed, :2] = step * gravity[:2]
    if loads.forces:
        place = {code: b for b, code in enumerate(scene.codes)}
        for load in loads.forces:
            bodies = np.array(sorted(place[code] for code in load.stones), dtype=np.int64)
            force, moment = load(state.time, *space(state, bodies))
            gained[bodies, :2] += step * model.inertia[bodies, :1] * force[:, :2]
            turn = np.where(bodies < len(model.radius), moment[:, 2], 0.0)  # walls do not turn
            gained[bodies, 2] += step * model.inertia[bodies, 1] * turn
    return gained


def load_work(model: PlanarModel, gained: Array, rate: Array) -> float:
    """Compute the product of the loads' impulses, which change the velocities by `gained` (nb, 3), with `rate` (nb, 3).

    With velocities it is a work [J]; with displacements, a work times the step.
    """
    free = ~model.fixed
    pushed = gained[free] * rate[free]
    power = model.mass[free] * (pushed[:, 0] + pushed[:, 1]) + model.moment[free] * pushed[:, 2]
    return float(power.sum())
