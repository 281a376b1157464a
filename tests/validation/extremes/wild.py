"""Contact problems at random: few bodies, many contacts, every scale drawn over decades."""

import numpy as np

from mechanics.arrays import Array
from mechanics.delassus.rigid import RigidDelassus, schedule
from mechanics.problem.problem import ContactProblem


def wild_problem(seed: int, decades: float) -> ContactProblem:
    """Up to six bodies and a fixed one with up to twenty contacts between any two of them.

    Masses, sizes, friction, cohesion, biases and velocities are drawn over so many decades; frames and lever arms are
    anyhow, so contacts may be redundant or contradict each other.
    """
    draw = np.random.default_rng(seed)
    bodies, count = int(draw.integers(1, 7)), int(draw.integers(1, 21))

    def spread(*shape: int) -> Array:
        values: Array = 10.0 ** draw.uniform(-decades / 2, decades / 2, shape)
        return values

    first = draw.integers(1, bodies + 1, count)
    second = (first + draw.integers(1, bodies + 1, count)) % (bodies + 1)
    pairs = np.stack([first, second], axis=1)
    size = np.concatenate([[1.0], spread(bodies)])
    inertia = _inertia(draw, spread(bodies), size[1:])
    frame, _ = np.linalg.qr(draw.normal(size=(count, 3, 3)))
    arms = draw.normal(size=(count, 2, 3)) * size[pairs][..., None]
    plan = schedule(pairs, np.arange(bodies + 1) > 0)
    geometry = np.concatenate([frame.reshape(count, 9), arms.reshape(count, 6)], axis=1)
    operator = RigidDelassus(pairs[plan.order], geometry[plan.order], inertia, plan)
    free = draw.normal(size=(count, 3)) * spread(count)[:, None]
    # half of them touch and close, as stones under their weight do
    free[draw.random(count) < 0.5, 0] *= -1.0
    none = np.zeros(count)
    return ContactProblem(
        operator,
        free,
        np.where(draw.random(count) < 0.3, draw.normal(size=count) * spread(count), none),
        np.where(draw.random(count) < 0.8, 0.5 * np.minimum(spread(count), 20.0), none),
        np.where(draw.random(count) < 0.2, spread(count), none),
    )


def _inertia(draw: np.random.Generator, mass: Array, size: Array) -> Array:
    """Inverse masses and the upper triangles of inverse inertias (nb+1, 7); body 0 is fixed."""
    rows = [np.zeros(7)]
    for m, s in zip(mass, size, strict=True):
        turn, _ = np.linalg.qr(draw.normal(size=(3, 3)))
        inverse = turn @ np.diag(draw.uniform(1.0, 10.0, 3)) @ turn.T / (m * s * s)
        rows.append(np.concatenate([[1.0 / m], inverse[np.triu_indices(3)]]))
    return np.array(rows)
