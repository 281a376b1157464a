"""Results made by hand, with numbers that are known, to try what is written and drawn of them."""

import itertools

import numpy as np

from mechanics.materials import Material
from mechanics.result import BodyResult, ContactResult, Energies, Errors, Frame, History, Outcome, Result
from mechanics.scene import Block, Fidelity, Scene

LIMESTONE = Material("limestone", density=2000.0, young=1e10, poisson=0.2)
BOX_FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def box(low, high):
    """(8, 3) corners of an axis-aligned box, bottom face then top face."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    ring = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    return np.array([(x, y, z) for z in (z0, z1) for x, y in ring], dtype=float)


def box_mesh(low, high, size):
    """Nodes and Kuhn tetrahedra (all of positive volume) of a box."""
    low, high = np.array(low, float), np.array(high, float)
    counts = np.maximum(1, np.round((high - low) / size).astype(int))
    axes = [np.linspace(a, b, n + 1) for a, b, n in zip(low, high, counts, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    strides = np.array([(counts[1] + 1) * (counts[2] + 1), counts[2] + 1, 1])
    tetrahedra = []
    for cell in itertools.product(*(range(n) for n in counts)):
        base = int(np.dot(cell, strides))
        for order in itertools.permutations(range(3)):
            path = [base]
            for axis in order:
                path.append(path[-1] + int(strides[axis]))
            if np.linalg.det(nodes[path[1:]] - nodes[path[0]]) < 0:
                path[2], path[3] = path[3], path[2]
            tetrahedra.append(path)
    return nodes, np.array(tetrahedra)


def boundary(tetrahedra):
    """Triangles that belong to one tetrahedron only, outward."""
    seen = {}
    for a, b, c, d in tetrahedra.tolist():
        for triangle in ((a, c, b), (a, b, d), (b, c, d), (a, d, c)):
            seen.setdefault(tuple(sorted(triangle)), []).append(triangle)
    return tuple(one[0] for one in seen.values() if len(one) == 1)


def rigid_body(code, low, high, fidelity=Fidelity.RIGID, shift=(0.0, 0.0, 0.0)):
    corners = box(low, high)
    volume = float(np.prod(np.subtract(high, low)))
    return BodyResult(
        code=code,
        fidelity=fidelity,
        reference=corners,
        position=corners + np.array(shift),
        faces=BOX_FACES,
        cells=np.empty((0, 4), dtype=np.int64),
        stress=None,
        von_mises=None,
        volume=volume,
        mass=volume * LIMESTONE.density,
        balance=3e-5,
    )


def deformable_body(code, low, high, von_mises, size=0.1, shift=(0.0, 0.0, 0.0)):
    """A meshed box whose Von Mises stress is the given function of its points."""
    nodes, tetrahedra = box_mesh(low, high, size)
    stress = np.zeros((len(nodes), 6))
    stress[:, 2] = -von_mises(nodes)
    volume = float(np.prod(np.subtract(high, low)))
    return BodyResult(
        code=code,
        fidelity=Fidelity.DEFORMABLE,
        reference=nodes,
        position=nodes + np.array(shift),
        faces=boundary(tetrahedra),
        cells=tetrahedra,
        stress=stress,
        von_mises=von_mises(nodes),
        volume=volume,
        mass=volume * LIMESTONE.density,
        balance=3e-5,
    )


def result_of(
    bodies, outcome=Outcome.EQUILIBRIUM, name="by hand", pairs=((1, 0),), forces=((0.0, 0.0, 1000.0),)
):
    """A result of ten steps around some bodies, whose first frame is the reference."""
    blocks = tuple(Block(b.code, box((0, 0, 0), (1, 1, 1)), BOX_FACES, LIMESTONE, b.fidelity) for b in bodies)
    count = len(pairs)
    steps = np.arange(1, 11)
    return Result(
        scene=Scene(name, blocks),
        outcome=outcome,
        steps=10,
        time=0.1,
        bodies=tuple(bodies),
        contacts=ContactResult(
            bodies=np.array(pairs, dtype=np.int64).reshape(-1, 2),
            point=np.zeros((count, 3)),
            normal=np.tile([0.0, 0.0, 1.0], (count, 1)),
            force=np.array(forces, dtype=float).reshape(-1, 3),
            gap=np.zeros(count),
            area=np.full(count, 0.01),
            status=np.array(["stick"] * count),
        ),
        errors=Errors(1e-7, 2e-6, 3e-5, 4e-4, float("nan"), 1),
        energies=Energies(5.0, -4.0, 1.0),
        rest_time=0.06,
        reaction=20010.0,
        weight=20000.0,
        frames=(
            Frame(0.0, tuple(b.reference for b in bodies)),
            Frame(0.1, tuple(b.position for b in bodies)),
        ),
        history=History(
            time=steps * 0.01,
            kinetic=10.0**-steps,
            speed=10.0**-steps,
            balance=10.0 ** (-steps / 2),
            natural_map=np.full(10, 1e-7),
            iterations=np.full(10, 100),
            contacts=np.full(10, count),
            penetration=np.full(10, 1e-8),
            settlement=steps * 1e-6,
        ),
        wall_time={"mesh": 0.5, "solve": 1.5},
    )
