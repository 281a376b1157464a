"""Largest values of a run and time series of chosen stones, followed in every step; those of stresses in its frames."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from mechanics.arrays import Array, Bools
from mechanics.carried import Carried, Carrier, Rows
from mechanics.contact.contacts import material_points
from mechanics.dynamics.observers.equilibrium import displacement, seen_from_supports
from mechanics.dynamics.step import Step
from mechanics.model._kernels import rigid_part
from mechanics.model.model import Model
from mechanics.results._kernels import StartCorners, joint_motion, keep_largest, patch_pressures
from mechanics.results.contact_result import JointResult
from mechanics.results.joints import SLIVER, StartingJoints, joint_corners, largest_faces
from mechanics.results.patch_pressure import REACH
from mechanics.results.result import Frame, JointSeries, Largest, Peak, Peaks, Series
from mechanics.scene.state import State
from mechanics.stones.elasticity.tensors import principal, von_mises


class Recorder(Carrier):
    """Motion of the stones of `Scene.series`, and what the joints of the start between two of them carry.

    Parameters
    ----------
    model, start : the scene, and its stones before they carry load
    """

    CARRIED = ("_of_joints", "_rows")
    REBUILT = ("_body", "_joint", "_model", "_normal", "_pair", "_start")

    def __init__(self, model: Model, start: State) -> None:
        codes = [block.code for block in model.scene.blocks]
        self._model, self._start = model, start
        self._body = np.array([codes.index(code) for code in model.scene.series], dtype=np.int64)
        self._rows: Rows[tuple[float, Array, Array, Array]] = Rows()
        self._of_joints: Rows[tuple[Array, Array, Array, Array]] = Rows()
        self._joint = np.zeros(0, dtype=np.int64)
        self._pair = np.zeros((0, 2), dtype=np.int64)
        self._normal = np.zeros((0, 3))

    def begin(self, joints: StartingJoints) -> None:
        """Choose the joints whose two stones are chosen."""
        self._joint = np.flatnonzero(np.isin(joints.bodies, self._body).all(axis=1))
        self._pair = joints.bodies[self._joint]
        # normals in the axes of the second stones
        axes = joints.state.rotation[self._pair[:, 1]]
        self._normal = np.einsum("jai,ja->ji", axes, joints.section.frame[self._joint, 0])

    def __call__(self, step: Step, opening: Array, sliding: Array) -> None:
        """Record one step; `opening` and `sliding` (nj,) are those of all joints of the start."""
        state, body = step.after, self._body
        velocity = state.velocity
        if self._model.elastic_stones.groups:
            velocity = np.where(self._model.elastic[:, None], self._elastic_motion(state), velocity)
        self._rows.append((state.time, state.centre[body], state.rotation[body], velocity[body]))
        self._of_joints.append((opening[self._joint], sliding[self._joint], *self._forces(step)))

    def series(self) -> Series:
        """Return the series of the run."""
        time, centre, rotation, velocity = (np.array(column) for column in zip(*self._rows, strict=True))
        since = rotation @ self._start.rotation[self._body].transpose(0, 2, 1)
        turn = Rotation.from_matrix(since.reshape(-1, 3, 3)).as_rotvec().reshape(centre.shape)
        columns = (np.array(column) for column in zip(*self._of_joints, strict=True))
        joints = JointSeries(self._joint, *columns)
        return Series(self._body, self._start.centre[self._body], time, centre, turn, velocity, joints)

    def _elastic_motion(self, state: State) -> Array:
        """Return the mean motion (nb, 6) of the elastic stones."""
        elastic = self._model.elastic_stones
        motion: Array = rigid_part(
            elastic.start, elastic.reference, elastic.projector, state.rotation, state.node_velocity
        )[0]
        return motion

    def _forces(self, step: Step) -> tuple[Array, Array]:
        """Return the forces (n,) across, compression positive, and along each of the joints [N]."""
        if not len(self._joint):
            return np.zeros(0), np.zeros(0)
        contacts = step.contacts
        normal = np.einsum("jia,ja->ji", step.after.rotation[self._pair[:, 1]], self._normal)
        pair = np.sort(contacts.bodies, axis=1)
        rows = np.flatnonzero(np.isin(contacts.bodies, self._body).all(axis=1) & (contacts.area > 0))
        same = (pair[rows, None] == self._pair).all(axis=2)
        # forces act on the candidate; in a joint, on the first stone
        sign = np.where(contacts.bodies[rows, 0] == pair[rows, 0], 1.0, -1.0)
        alike = np.where(same, (sign[:, None] * contacts.frame[rows, 0]) @ normal.T, -np.inf)
        recorded = same.any(axis=1)
        total = np.zeros_like(normal)
        if recorded.any():
            np.add.at(total, alike[recorded].argmax(axis=1), (sign[:, None] * step.force[rows])[recorded])
        across = np.einsum("ji,ji->j", total, normal)
        return across, np.linalg.norm(total - across[:, None] * normal, axis=1)


class PeakTracker(Carrier):
    """Largest values so far, and the time series of chosen stones.

    Displacements are those of `displacement`, of stones that are not fixed; relative ones are seen from the supports.
    Opening and sliding of the joints of the start are followed at their corners, also where stones have parted.
    Pressures are those of `patch_pressure`, of joints that are not slivers. Forces are means over a step.

    Parameters
    ----------
    model, start : the scene, and its stones before they carry load, from where displacements count
    """

    CARRIED = (
        "_displacement", "_opening", "_pressure", "_relative", "_series", "_shear", "_sliding", "_vertical",
    )  # fmt: skip
    REBUILT = ("_joints", "_least", "_model", "_moves", "_sign", "_start")

    def __init__(self, model: Model, start: State) -> None:
        count = len(model.mass)
        self._model, self._start, self._moves = model, start, ~model.fixed
        self._displacement, self._opening, self._sliding, self._pressure = (
            _record(count, start.time) for _ in range(4)
        )
        self._relative = _record(count, start.time) if model.motions else self._displacement
        self._least = SLIVER * largest_faces(model)
        self._sign = np.zeros(count)
        self._sign[model.fixed] = 1.0
        # reactions of the supports, of no step so far
        self._vertical = self._shear = -np.inf, start.time, np.nan
        self._joints: StartCorners | None = None
        self._series = Recorder(model, start) if model.scene.series else None

    def restore(self, carried: Carried) -> None:
        """Take over the largest values so far."""
        super().restore(carried)
        if not self._model.motions:
            self._relative = self._displacement

    def begin(self, joints: StartingJoints) -> None:
        """Take the joints of the start."""
        self._joints = joint_corners(joints)
        if self._series is not None:
            self._series.begin(joints)

    def __call__(self, step: Step) -> None:
        """Account for one step."""
        model, after, contacts = self._model, step.after, step.contacts
        _keep(self._displacement, displacement(model, self._start, after), after.time, self._moves)
        if model.motions:
            seen = seen_from_supports(model, self._start, after)
            _keep(self._relative, displacement(model, self._start, seen), after.time, self._moves)
        assert self._joints is not None
        opening, sliding = joint_motion(self._joints, after.centre, after.rotation)
        keep_largest(self._joints.bodies, opening, after.time, self._opening)
        keep_largest(self._joints.bodies, sliding, after.time, self._sliding)
        # distances are the same in the axes of a rigid stone
        point = material_points(contacts, after) if contacts.weights.nnz else contacts.arm
        pairs, pressure = patch_pressures(
            contacts.bodies, contacts.frame, point[:, 0], step.force, contacts.area, REACH, self._least
        )
        keep_largest(pairs, pressure, after.time, self._pressure)
        sign = self._sign[contacts.bodies[:, 1]] - self._sign[contacts.bodies[:, 0]]
        self._react(after.time, sign @ step.force)
        if self._series is not None:
            self._series(step, opening, sliding)

    def peaks(self, frames: Sequence[Frame], joints: JointResult, end: State) -> Peaks:
        """Return the peaks of the run, with the stresses of its frames and its joints at the end."""
        model, time = self._model, end.time
        for frame in frames:
            in_joint = np.flatnonzero(frame.contacts.joint >= 0)
            bodies = frame.contacts.bodies[in_joint]
            keep_largest(bodies, frame.contacts.opening[in_joint], frame.time, self._opening)
            keep_largest(bodies, frame.contacts.slide[in_joint], frame.time, self._sliding)
        whole = np.flatnonzero(~joints.sliver)
        for record, values in (
            (self._opening, joints.opening),
            (self._sliding, joints.sliding),
            (self._pressure, joints.pressure_max),
        ):
            rows = whole if record is self._pressure else np.arange(len(joints))
            keep_largest(joints.bodies[rows], values[rows], time, record)
        seen = seen_from_supports(model, self._start, end)
        return Peaks(
            displacement=_known(self._displacement, self._moves),
            relative=_known(self._relative, self._moves),
            relative_end=np.where(self._moves, displacement(model, self._start, seen), np.nan),
            opening=self._opening,
            sliding=self._sliding,
            pressure=self._pressure,
            **_stresses(frames),
            reaction=Peak(*self._vertical),
            shear=Peak(*self._shear),
        )

    def series(self) -> Series | None:
        """Return the time series of the chosen stones; None where none is chosen."""
        return None if self._series is None else self._series.series()

    def _react(self, time: float, force: Array) -> None:
        """Account for the reaction of the supports (3,) [N], against gravity (z without it) and across."""
        gravity = self._model.gravity(time)
        size = float(np.linalg.norm(gravity))
        up = -gravity / size if size > 0 else np.array([0.0, 0.0, 1.0])
        along = float(force @ up)
        self._vertical = _larger(self._vertical, along, time)
        self._shear = _larger(self._shear, float(np.linalg.norm(force - along * up)), time)


def _larger(peak: tuple[float, float, float], value: float, time: float) -> tuple[float, float, float]:
    """Return value, time and last value of a peak after a further value."""
    largest, when, _ = peak
    return (value, time, value) if value > largest else (largest, when, value)


def _stresses(frames: Sequence[Frame]) -> dict[str, Largest]:
    """Return the largest stresses of each stone in the frames; NaN where they are not known."""
    count = len(frames[0].stresses)
    records = {name: _record(count, np.nan) for name in ("von_mises", "tension", "compression")}
    for record in records.values():
        record.value[:] = -np.inf
    for frame in frames:
        for body, stress in enumerate(frame.stresses):
            if stress is None:
                continue
            values = principal(stress)[0]
            found = float(von_mises(stress).max()), float(values[:, 0].max()), float(-values[:, 2].min())
            for record, value in zip(records.values(), found, strict=True):
                if value > record.value[body]:
                    record.value[body], record.time[body] = value, frame.time
    return {name: _known(record, np.isfinite(record.value)) for name, record in records.items()}


def _record(count: int, time: float) -> Largest:
    return Largest(np.zeros(count), np.full(count, time), np.full(count, -1))


def _keep(record: Largest, values: Array, time: float, rows: Bools) -> None:
    more = rows & (values > record.value)
    record.value[more] = values[more]
    record.time[more] = time


def _known(record: Largest, rows: Bools) -> Largest:
    """Return the record with NaN in the other rows."""
    return Largest(np.where(rows, record.value, np.nan), np.where(rows, record.time, np.nan), record.partner)
