"""Results made by hand, with numbers that are known, to try what is written and drawn of them."""

import itertools

import numpy as np

from mechanics.dynamics.outcome import Outcome
from mechanics.results.contact_result import ContactResult, JointResult
from mechanics.results.postprocess import surface_polygons
from mechanics.results.result import BodyResult, Energies, Errors, Frame, Result, RunHistory
from mechanics.results.stress_values import stress_values
from mechanics.scene.scene import Block, Fidelity, Scene
from mechanics.scene.shapes import BOX_FACES, box_corners
from mechanics.stones.elasticity.operators import node_volumes
from mechanics.stones.elasticity.tensors import principal
from mechanics.stones.elasticity.tensors import von_mises as equivalent_stress
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.mesh import SolidMesh

LIMESTONE = Material("limestone", density=2000.0, young=1e10, poisson=0.2)
box = box_corners


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
        element=None,
        cells=np.empty((0, 4), dtype=np.int64),
        stress=None,
        von_mises=None,
        principal=None,
        node_volume=None,
        values=None,
        volume=volume,
        mass=volume * LIMESTONE.density,
        balance=3e-5,
    )


def deformable_body(
    code, low, high, von_mises, size=0.1, shift=(0.0, 0.0, 0.0), material=LIMESTONE, error=0.1
):
    """A meshed box, pressed upright by the given function of its points, which is its Von Mises stress too."""
    nodes, tetrahedra = box_mesh(low, high, size)
    facets = np.array(boundary(tetrahedra))
    mesh = SolidMesh(Element.TET4, nodes, tetrahedra, facets, np.zeros(len(facets), dtype=np.int64))
    stress = np.zeros((len(nodes), 6))
    stress[:, 2] = -von_mises(nodes)
    return meshed_body(code, mesh, stress, shift, material, error)


def meshed_body(code, mesh, stress, shift=(0.0, 0.0, 0.0), material=LIMESTONE, error=0.1):
    """A stone of finite elements of any kind, with the given stress (n, 6) of its nodes."""
    volume = node_volumes(mesh)
    return BodyResult(
        code=code,
        fidelity=Fidelity.DEFORMABLE,
        reference=mesh.nodes,
        position=mesh.nodes + np.array(shift),
        faces=surface_polygons(mesh),
        element=mesh.element,
        cells=mesh.cells,
        stress=stress,
        von_mises=equivalent_stress(stress),
        principal=principal(stress)[0],
        node_volume=volume,
        values=stress_values(stress, mesh.nodes + np.array(shift), volume, material, error),
        volume=float(volume.sum()),
        mass=float(volume.sum()) * material.density,
        balance=3e-5,
    )


def joints_of(pairs, forces, heights):
    """One joint per pair of bodies: a level square of 1 m² at a height, its resultant at 0.1 m, 0.2 m, … along x."""
    count = len(pairs)
    square = box((0, 0, 0), (1, 1, 1))[:4]
    normal = np.array(forces, dtype=float).reshape(-1, 3)[:, 2]
    away = 0.1 * np.arange(1, count + 1)
    centroid = np.array([[0.5, 0.5, height] for height in heights]).reshape(-1, 3)
    return JointResult(
        bodies=np.sort(np.array(pairs, dtype=np.int64).reshape(-1, 2), axis=1),
        parted=np.zeros(count, dtype=bool),
        polygon=tuple(square + np.array([0.0, 0.0, height]) for height in heights),
        frame=np.tile(np.array([[0.0, 0, -1], [1, 0, 0], [0, -1, 0]]), (count, 1, 1)),
        centroid=centroid,
        area=np.ones(count),
        sliver=np.zeros(count, dtype=bool),
        force=-np.array(forces, dtype=float).reshape(-1, 3),
        moment=np.column_stack([np.zeros(count), normal * away, np.zeros(count)]),
        centre_of_pressure=centroid + np.column_stack([away, np.zeros((count, 2))]),
        eccentricity=np.column_stack([away, np.zeros(count)]),
        kern=6.0 * away,
        edge=2.0 * away,
        pressure_mean=normal,
        pressure_max=1.5 * normal,
        gap=1e-4 * np.arange(count),
        opening=1e-4 * np.arange(count),
        sliding=1e-3 * np.arange(1, count + 1),
        slipping=np.zeros(count),
        open=np.zeros(count),
        friction_use=np.full(count, 0.5),
    )


def contacts_of(pairs, forces):
    """One contact point per pair of bodies."""
    count, force = len(pairs), np.array(forces, dtype=float).reshape(-1, 3)
    return ContactResult(
        bodies=np.array(pairs, dtype=np.int64).reshape(-1, 2),
        point=np.zeros((count, 3)),
        normal=np.tile([0.0, 0.0, 1.0], (count, 1)),
        force=force,
        gap=np.zeros(count),
        area=np.full(count, 0.01),
        pressure=force[:, 2] / 0.01,
        opening=np.zeros(count),
        slide=np.full(count, 1e-3),
        status=np.array(["stick"] * count),
        joint=np.arange(count),
    )


def result_of(
    bodies,
    outcome=Outcome.EQUILIBRIUM,
    name="by hand",
    pairs=((1, 0),),
    forces=((0.0, 0.0, 1000.0),),
    material=LIMESTONE,
):
    """A result of ten steps around some bodies, whose first frame is the reference."""
    blocks = tuple(Block(b.code, box((0, 0, 0), (1, 1, 1)), BOX_FACES, material, b.fidelity) for b in bodies)
    contacts, steps = contacts_of(pairs, forces), np.arange(1, 11)
    return Result(
        scene=Scene(name, blocks),
        outcome=outcome,
        steps=10,
        time=0.1,
        bodies=tuple(bodies),
        contacts=contacts,
        joints=joints_of(pairs, forces, [bodies[under].position[:, 2].max() for _, under in pairs]),
        errors=Errors(1e-7, 2e-6, 3e-5, 4e-4, float("nan"), 1),
        energies=Energies(5.0, -4.0, 1.0),
        rest_time=0.06,
        reaction=20010.0,
        weight=20000.0,
        frames=(
            frame_of(0.0, bodies, [b.reference for b in bodies], 0.0, contacts_of((), ())),
            frame_of(0.1, bodies, [b.position for b in bodies], 1.0, contacts),
        ),
        history=RunHistory(
            time=steps * 0.01,
            kinetic=10.0**-steps,
            speed=10.0**-steps,
            balance=10.0 ** (-steps / 2),
            natural_map=np.full(10, 1e-7),
            iterations=np.full(10, 100),
            contacts=np.full(10, len(pairs)),
            penetration=np.full(10, 1e-8),
            settlement=steps * 1e-6,
        ),
        wall_time={"mesh": 0.5, "solve": 1.5},
    )


def frame_of(time, bodies, positions, load, contacts):
    """An instant at which the bodies bear a part of their stress."""
    return Frame(
        time=time,
        positions=tuple(positions),
        velocities=tuple(np.full(b.reference.shape, 0.5) for b in bodies),
        stresses=tuple(None if b.stress is None else load * b.stress for b in bodies),
        stress_errors=tuple(None if b.values is None else b.values.error for b in bodies),
        contacts=contacts,
    )
