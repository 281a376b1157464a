"""Stones, scenes and reference operators that the tests of the mechanics share."""

import itertools
from dataclasses import dataclass, replace

import numpy as np
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from mechanics.contact.contacts import material_points
from mechanics.contact.detection import Detector
from mechanics.dynamics.contact_problem import contact_problem
from mechanics.dynamics.contact_search import Detection, detection
from mechanics.dynamics.handover import of_run
from mechanics.dynamics.stepping import compliances, free_kick
from mechanics.model.model import Model, build_model
from mechanics.problem._kernels import local_factors, solve_contact
from mechanics.problem.problem import ContactProblem
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.law import STATE
from mechanics.scene.scene import Block, ContactSettings, Fidelity, Part, Placement, Scene, TimeSettings
from mechanics.scene.shapes import BOX_FACES, drum, wall
from mechanics.scene.state import State
from mechanics.stones.materials import Material
from tests.pipelines.results_by_hand import box

LIMESTONE = Material("limestone", density=2000.0, young=1e9, poisson=0.2)
TURN = Rotation.from_rotvec([0.4, -0.7, 1.1]).as_matrix()
TETRAHEDRON_FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))


def brick(code, low, high, fidelity=Fidelity.RIGID, **more):
    """An axis-aligned block."""
    if fidelity is Fidelity.DEFORMABLE:
        more.setdefault("mesh_size", 0.5)
    material = more.pop("material", LIMESTONE)
    return Block(code, box(low, high), BOX_FACES, material, fidelity, **more)


def ground(low=(-2.0, -2.0, -1.0), high=(3.0, 3.0, 0.0), code="ground"):
    return brick(code, low, high, Fidelity.FIXED)


def moved(block, turn=None, shift=(0.0, 0.0, 0.0), scale=1.0):
    """The same stone, scaled, then turned about the origin, then moved."""
    turn = np.eye(3) if turn is None else turn

    def there(vertices):
        return scale * vertices @ turn.T + np.array(shift)

    size = None if block.mesh_size is None else scale * block.mesh_size
    parts = tuple(Part(there(part.vertices), part.faces) for part in block.parts)
    return replace(block, vertices=there(block.vertices), mesh_size=size, parts=parts)


def transformed(one, turn=None, shift=(0.0, 0.0, 0.0), scale=1.0):
    """The same scene, scaled, then turned about the origin, then moved."""
    return replace(one, blocks=tuple(moved(block, turn, shift, scale) for block in one.blocks))


def scene(*blocks, gravity=(0.0, 0.0, -9.81), friction=0.6, alert=0.05, **time):
    return Scene(
        "test",
        blocks,
        gravity=gravity,
        contact=ContactSettings(DryJoint(friction), alert_distance=alert),
        time=TimeSettings(**time),
    )


def opening(**time):
    """A wall of stones half a metre long with an opening of 0.75 m, a stone of the course above it over nothing."""
    stones = []
    for course in range(5):
        edges = np.unique(np.clip(np.arange(-0.25 * (course % 2), 3.1, 0.5), 0.0, 2.75))
        for k, (low, high) in enumerate(itertools.pairwise(edges)):
            sides = ((low, min(high, 1.125)), (max(low, 1.875), high)) if course < 3 else ((low, high),)
            stones += [
                brick(f"{course}-{k}-{n}", (a, 0, 0.25 * course), (b, 0.25, 0.25 * course + 0.25))
                for n, (a, b) in enumerate(sides)
                if b > a
            ]
    return scene(ground(), *stones, duration=1.0, **time)


def detected(one, points=4, placement=Placement.CORNERS, spacing=None):
    """Model, state at the start and the contacts in it."""
    model, state = build_model(one)
    find = Detector(
        model.surfaces, model.fixed, one.contact.alert_distance, points, placement, spacing=spacing
    )
    return model, state, find(state, np.zeros(len(one.blocks)))


@st.composite
def hexahedra(draw):
    """Corners of a convex hexahedron with planar faces: a box seen through a projective map, turned and moved.

    Lengths range over a factor of 3, faces lean by up to some 20°.
    """
    number = st.floats(-1.0, 1.0, allow_subnormal=False)
    extent = np.array([draw(st.floats(0.4, 1.2)) for _ in range(3)])
    lean = 0.15 * np.array([draw(number) for _ in range(3)])
    corners = box(-extent / 2, extent / 2)
    corners = corners / (1.0 + corners @ lean)[:, None]
    turn = Rotation.from_rotvec([3.0 * draw(number) for _ in range(3)]).as_matrix()
    return corners @ turn.T + 10.0 * np.array([draw(number) for _ in range(3)])


def dense_operator(model, state, contacts, compliance, common=False):
    """ŵ and Hᵀ as dense matrices over six velocities for each rigid body and three for each node, world axes.

    Written from the definitions alone: the velocity of a material point, and the inverse of M + h²θ²K. With `common`
    the point lies half-way between the two material points.
    """
    groups = zip(model.elastic_stones.groups, compliance, strict=True)
    compliance = {int(b): own for group, own in groups for b in group.bodies}
    start = model.elastic_stones.start
    bodies, nodes = len(model.mass), len(state.node)
    w_hat = np.zeros((6 * bodies + 3 * nodes,) * 2)
    transpose = np.zeros((3 * len(contacts), len(w_hat)))
    for b in range(bodies):
        turn = state.rotation[b]
        if b in compliance:
            rows = slice(6 * bodies + 3 * start[b], 6 * bodies + 3 * start[b + 1])
            axes = np.kron(np.eye(len(model.stones[b].mesh.nodes)), turn)
            w_hat[rows, rows] = axes @ np.linalg.inv(compliance[b].matrix.toarray()) @ axes.T
        elif not model.fixed[b]:
            w_hat[6 * b : 6 * b + 3, 6 * b : 6 * b + 3] = np.eye(3) / model.mass[b]
            moment = turn @ model.inertia.inertia[b] @ turn.T
            w_hat[6 * b + 3 : 6 * b + 6, 6 * b + 3 : 6 * b + 6] = np.linalg.inv(moment)
    weights = contacts.weights.toarray()
    places = material_points(contacts, state)
    for c, side in itertools.product(range(len(contacts)), range(2)):
        b, sign = contacts.bodies[c, side], 1.0 - 2.0 * side
        rows = slice(3 * c, 3 * c + 3)
        if b in compliance:
            for n in np.flatnonzero(weights[2 * c + side]):
                columns = slice(6 * bodies + 3 * n, 6 * bodies + 3 * n + 3)
                transpose[rows, columns] += sign * weights[2 * c + side, n] * contacts.frame[c]
        else:
            x, y, z = (places[c].mean(axis=0) if common else places[c, side]) - state.centre[b]
            lever = np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])  # ω × arm = lever ω
            transpose[rows, 6 * b : 6 * b + 6] += sign * contacts.frame[c] @ np.hstack([np.eye(3), lever])
    return w_hat, transpose


def hull(points):
    """Corners and faces, counter-clockwise seen from outside, of the convex hull of points; all faces triangles."""
    shape = ConvexHull(points)
    corners = shape.points[shape.vertices]
    number = {vertex: n for n, vertex in enumerate(shape.vertices)}
    faces = []
    for simplex, equation in zip(shape.simplices, shape.equations, strict=True):
        a, b, c = shape.points[simplex]
        ordered = simplex if np.cross(b - a, c - a) @ equation[:3] > 0 else simplex[::-1]
        faces.append(tuple(number[vertex] for vertex in ordered))
    return corners, tuple(faces)


def prism(ring, bottom, top):
    """Corners and faces of an upright prism over a convex polygon (n, 2), counter-clockwise."""
    stone = drum("prism", ring, ring, (bottom, top))
    return stone.vertices, stone.faces


def ellipse(sides, axes, turn=0.0, centre=(0.0, 0.0)):
    """A polygon (sides, 2) on an ellipse, counter-clockwise."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) * axes
    c, s = np.cos(turn), np.sin(turn)
    return ring @ np.array([[c, s], [-s, c]]) + centre


def random_stone(rng):
    """A random convex polyhedron about the origin: a leaning box, a tetrahedron, a prism or a hull of points."""
    kind = rng.integers(4)
    turn = Rotation.random(random_state=rng).as_matrix()
    if kind == 0:
        extent, lean = rng.uniform(0.4, 1.2, 3), rng.uniform(-0.15, 0.15, 3)
        corners = box(-extent / 2, extent / 2)
        return corners / (1.0 + corners @ lean)[:, None] @ turn.T, BOX_FACES
    if kind == 1:
        return hull(rng.uniform(0.5, 1.2) * np.vstack([np.eye(3), -np.ones(3) / 3]) @ turn.T)
    if kind == 2:
        half = rng.uniform(0.15, 0.4)
        corners, faces = prism(ellipse(int(rng.integers(3, 9)), rng.uniform(0.3, 0.8, 2)), -half, half)
        return corners @ turn.T, faces
    points = rng.normal(size=(int(rng.integers(5, 15)), 3))
    return hull(rng.uniform(0.3, 0.7) * points / np.linalg.norm(points, axis=1)[:, None])


def pile(seed, stones=8, near=0.45, **more):
    """A scene of random convex stones, the closer the smaller `near`; the first is fixed."""
    rng = np.random.default_rng(seed)
    blocks = []
    for k in range(stones):
        corners, faces = random_stone(rng)
        place = near * stones ** (1 / 3) * rng.normal(size=3)
        blocks.append(
            Block(str(k), corners + place, faces, LIMESTONE, Fidelity.FIXED if k == 0 else Fidelity.RIGID)
        )
    return scene(*blocks, **more)


def profile(code, outline, parts, depth=1.0, **more):
    """A stone with a profile (n, 2) in x and z, counter-clockwise seen along y, made of convex profiles.

    It spans 0 ≤ y ≤ depth; an outline with corners that lean in makes it non-convex.
    """

    def upright(ring):
        corners, faces = prism(np.asarray(ring, dtype=float), 0.0, depth)
        # prisms stand on their ring: lay it down, (x, y, z) → (x, depth - z, y)
        return np.column_stack([corners[:, 0], depth - corners[:, 2], corners[:, 1]]), faces

    vertices, faces = upright(outline)
    pieces = tuple(Part(*upright(ring)) for ring in parts)
    return Block(code, vertices, faces, more.pop("material", LIMESTONE), parts=pieces, **more)


def rectangle(x0, z0, x1, z1):
    """Corners of a rectangle, counter-clockwise."""
    return [(x0, z0), (x1, z0), (x1, z1), (x0, z1)]


@dataclass(frozen=True)
class Posed:
    """The first step's contact problem of a scene, and what it is made of."""

    model: Model
    state: State
    found: Detection
    compliance: tuple
    problem: ContactProblem

    @property
    def contacts(self):
        return self.found.contacts

    @property
    def operator(self):
        return self.found.operator


def partly_deformable_wall():
    """A wall of five courses on a slab; three stones of it deform."""
    soft, even, odd = {"2-2", "3-2", "3-3"}, [1.0, 1.0, 1.0], [0.5, 1.0, 1.0, 0.5]
    blocks = wall([even, odd, even, odd, even], 3.0, 0.4, 0.5, mesh_size=0.5)
    mixed = [replace(one, fidelity=Fidelity.DEFORMABLE) if one.code in soft else one for one in blocks]
    return scene(*mixed, friction=0.6)


def posed(one, step=2e-3, theta=1.0):
    """The contact problem in the configuration in which a scene begins."""
    model, state, contacts = detected(one, one.contact.points, one.contact.placement)
    compliance = compliances(model, step, theta)
    found = detection(model, state, contacts, compliance)
    free = free_kick(model, state, state, compliance, step, theta)
    problem, _ = contact_problem(model, state, found, free, np.zeros((len(contacts), STATE)), of_run(state))
    return Posed(model, state, found, compliance, problem)


def slow_pass(dense, r, shift, mu, cohesion, order):
    """Gauss–Seidel with the dense W, contact by contact in a given order."""
    for c in order:
        rows = slice(3 * c, 3 * c + 3)
        block = dense[rows, rows]
        b = shift[c] + dense[rows] @ r.ravel() - block @ r[c]
        solve_contact(local_factors(block[None])[0], b, mu[c], cohesion[c], r[c])
