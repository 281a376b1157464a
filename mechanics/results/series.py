"""Time series of chosen stones, and of the joints between them."""

import numpy as np
from scipy.spatial.transform import Rotation

from mechanics.arrays import Array
from mechanics.carried import Carrier, Rows
from mechanics.dynamics.step import Step
from mechanics.model._kernels import rigid_part
from mechanics.model.model import Model
from mechanics.results.joints import StartingJoints
from mechanics.results.result import JointSeries, Series
from mechanics.scene.state import State


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
