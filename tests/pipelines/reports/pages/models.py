"""Models of viewers with stones whose places and motions are known."""

import numpy as np

from mechanics.scene.shapes import BOX_FACES, box_corners
from pipelines.reports.page.model import Column, Model, Motion
from pipelines.reports.page.surfaces import stones_of


def wall_model(count, instants=2, seed=1, code="S{}"):
    """A wall of bricks that move at random, a little more in every instant."""
    random = np.random.default_rng(seed)
    wide = int(np.ceil(np.sqrt(count)))
    places = [(k % wide, 0.0, 0.5 * (k // wide)) for k in range(count)]
    shapes = [(box_corners(place, np.add(place, (0.95, 0.4, 0.48))), BOX_FACES) for place in places]
    mesh, _ = stones_of([code.format(k) for k in range(count)], shapes)
    centres = np.array([points.mean(axis=0) for points, _ in shapes])
    steps = random.normal(size=(2, instants, count, 3))
    steps[:, 0] = 0.0
    shift, turn = 1e-4 * np.cumsum(steps[0], axis=0), 1e-4 * np.cumsum(steps[1], axis=0)
    motion = Motion(np.linspace(0.0, 1.0, instants), centres, shift, turn, np.arange(count) < wide)
    columns = [
        Column("kind", "kind", None, ["header" if k % 3 else "stretcher" for k in range(count)], "Stone"),
        Column("course", "course", "-", np.array([k // wide for k in range(count)], dtype=float), "Stone"),
        Column("von_mises_max", "largest Von Mises stress", "Pa", random.uniform(0, 1e6, count), "Results"),
    ]
    return Model("Wall", mesh, columns, motion=motion, colour="von_mises_max")
