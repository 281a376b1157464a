"""A synthetic block of photographs of a wall, with known truth."""

from dataclasses import dataclass, replace

import numpy as np

from survey.orientation.network import Camera, Control, Network, Photo
from survey.orientation.projection import project
from survey.orientation.rotations import from_angles

SIZE = (6000, 4000)
INNER = np.array([24.0, 18.05, 11.97, 2e-4, 1e-4, 1.2e-4, -1.5e-7, 1e-10, 1.1e-5, -0.7e-5])


@dataclass(frozen=True)
class Truth:
    """The network without noise, and its true values."""

    network: Network
    points: np.ndarray


def looking(station, target, roll=0.0):
    """Rotation of a camera at a station that looks at a target, z of the world upwards on the photograph."""
    back = np.asarray(station, float) - target
    back /= np.linalg.norm(back)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    axes = np.column_stack([right, np.cross(back, right), back])
    return axes @ from_angles(0.0, 0.0, roll)


def wall_block(
    columns=4, rows=2, points=200, seed=1, relief=0.4, free=(), forward=False, size=(8.0, 4.0), reach=None
):
    """Photographs of a wall in the plane y = 0, taken from 6 m in front of it, two rows of them, every other turned."""
    rng = np.random.default_rng(seed)
    width, height = size
    place = rng.uniform([0, -relief / 2, 0], [width, relief / 2, height], (points, 3))
    photos = []
    for r in range(rows):
        for c in range(columns):
            at = np.array(
                [
                    (c + 0.5) * width / columns,
                    -6.0 - 0.3 * (c % 2),
                    0.5 + r * (height - 1.0) / max(rows - 1, 1),
                ]
            )
            target = np.array([at[0] + (1.5 if c < columns / 2 else -1.5) * (columns > 1), 0.0, height / 2])
            turn = looking(at, target, np.pi / 2 * ((r + c) % 2))
            photos.append(Photo(f"P{len(photos) + 1:02d}", 0, turn, at))
    camera = Camera("camera1", INNER, SIZE, 24.0 / SIZE[1], forward=forward, free=tuple(free))
    of, which, image = [], [], []
    for f, photo in enumerate(photos):
        near = (
            np.arange(points)
            if reach is None
            else np.flatnonzero(np.abs(place[:, 0] - photo.station[0]) < reach)
        )
        seen = project(camera, photo.rotation, photo.station, place[near])
        inside = ((seen > 0.0) & (seen < SIZE)).all(axis=1)
        of.append(np.full(inside.sum(), f))
        which.append(near[inside])
        image.append(seen[inside])
    of, which, image = np.concatenate(of), np.concatenate(which), np.concatenate(image)
    often = np.bincount(which, minlength=points) >= 2
    new = np.cumsum(often) - 1
    kept = often[which]
    of, which, image, place = of[kept], new[which[kept]], image[kept], place[often]
    network = Network(
        "block",
        (camera,),
        tuple(photos),
        tuple(f"{i + 1}" for i in range(len(place))),
        place.copy(),
        (),
        of,
        which,
        image,
        np.full(image.shape, 0.5),
        np.arange(len(of)) + 1,
    )
    return Truth(network, place)


def with_points(truth, chosen, sigma=0.002, check=False):
    """The network with some of its points as control, at their true places."""
    control = tuple(Control(int(i), truth.points[i], sigma**2 * np.eye(3), check) for i in chosen)
    return replace(truth.network, control=truth.network.control + control)


def noisy(network, rng, scale=1.0):
    """The network with noise in its marks and its control points, as their standard deviations say."""
    image = network.image + scale * rng.normal(size=network.image.shape) * network.sigma
    control = tuple(
        replace(one, place=one.place + rng.multivariate_normal(np.zeros(3), one.covariance))
        for one in network.control
    )
    return replace(network, image=image, control=control)


def spread_points(truth, count):
    """Indices of points far from each other, the corners of the wall first."""
    place = truth.points
    found = [int(np.argmin(place.sum(axis=1)))]
    while len(found) < count:
        far = np.min(np.linalg.norm(place[:, None] - place[found][None], axis=2), axis=1)
        found.append(int(np.argmax(far)))
    return found


def write_marks(network, path):
    """Write the marks of a network with all digits; of unequal deviations of x and y, the root mean square."""
    text = ["# photograph, point, x, y, sigma [px]"]
    for k in range(len(network.photo)):
        x, y = network.image[k].tolist()
        sigma = float(np.sqrt((network.sigma[k] ** 2).mean()))
        text.append(
            f"{network.photos[network.photo[k]].name}, {network.names[network.point[k]]}, {x!r}, {y!r}, {sigma!r}"
        )
    path.write_text("\n".join([*text, ""]), encoding="utf-8", newline="\n")
