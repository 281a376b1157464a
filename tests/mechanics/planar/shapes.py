"""Small contact problems and packings of the plane for the tests."""

import numpy as np

from mechanics.planar.scene import Disk, PlanarScene, PlanarTime, Wall
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import Method, SolverSettings

G = 9.81
ACCURATE = SolverSettings(Method.NSGS, tolerance=1e-12, max_iterations=20000)


def random_problem(seed, bodies=12, contacts=30, levers=True):
    """Bodies (the last one fixed), frames, lever arms and inverse inertias, drawn at random."""
    rng = np.random.default_rng(seed)
    first = rng.integers(0, bodies - 1, contacts)
    second = (first + rng.integers(1, bodies, contacts)) % bodies
    angle = rng.uniform(0, 2 * np.pi, contacts)
    normal = np.column_stack([np.cos(angle), np.sin(angle)])
    lever = rng.normal(size=(contacts, 4))
    if not levers:
        # as disks have them: the arm runs along the normal
        lever[:, [0, 2]] = 0.0
    inertia = rng.uniform(0.2, 3.0, (bodies, 2))
    inertia[-1] = 0.0
    return np.column_stack([first, second]), normal, lever, inertia


def dense(bodies, normal, lever, inertia):
    """Hᵀ (2 nc, 3 nb) from its definition, and M⁻¹ (3 nb, 3 nb)."""
    nc, nb = len(bodies), len(inertia)
    ht = np.zeros((2 * nc, 3 * nb))
    for c in range(nc):
        n = normal[c]
        t = np.array([-n[1], n[0]])
        for side, sign in ((0, 1.0), (1, -1.0)):
            b = bodies[c, side]
            for row, axis in enumerate((n, t)):
                ht[2 * c + row, 3 * b : 3 * b + 3] += sign * np.append(axis, lever[c, 2 * side + row])
    weights = np.column_stack([inertia[:, 0], inertia[:, 0], inertia[:, 1]]).ravel()
    return ht, np.diag(weights)


def grid_of_disks(columns, rows, radius=0.01, seed=0, spread=0.2):
    """Disks of mixed sizes on a loose lattice that starts at the origin; centres (n, 2), radii (n,)."""
    rng = np.random.default_rng(seed)
    radii = radius * rng.uniform(1 - spread, 1 + spread, columns * rows)
    width = 2.05 * radius * (1 + spread)
    row, column = np.divmod(np.arange(columns * rows), columns)
    centres = (np.column_stack([column, row]) + 0.5) * width
    return centres + rng.uniform(-0.01, 0.01, centres.shape) * radius, radii


def box(centres, radii, *, friction=0.3, wall_friction=None, time=None, solver=ACCURATE, **more):
    """A scene of disks in a box without a lid."""
    left, right = float((centres[:, 0] - radii).min()), float((centres[:, 0] + radii).max())
    low, top = float((centres[:, 1] - radii).min()), 2 * float((centres[:, 1] + radii).max())
    return PlanarScene(
        "box",
        tuple(Disk(f"d{i}", tuple(c), float(r)) for i, (c, r) in enumerate(zip(centres, radii, strict=True))),
        (
            Wall("bottom", (left, low), (right, low)),
            Wall("left", (left, low), (left, top)),
            Wall("right", (right, low), (right, top)),
        ),
        law=DryJoint(friction),
        time=time or PlanarTime(),
        solver=solver,
        **more,
    )
