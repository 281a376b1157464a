"""Model of a scene for computation: meshes, masses, surfaces; constant during a run."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain

import numpy as np

from ground.errors import GeometryError, SceneError
from mechanics.arrays import Array, Bools, Ints
from mechanics.contact._kernels.narrow_phase import MAX_CORNERS
from mechanics.contact.face_meshes import FaceMesh
from mechanics.contact.part_faces import face_meshes, part_face_meshes
from mechanics.contact.surfaces import Surfaces, surfaces
from mechanics.model.balls import ball_properties
from mechanics.model.deformable import Deformable
from mechanics.model.rigid import RigidInertia
from mechanics.model.stone_groups import ElasticStones, elastic_stones
from mechanics.model.stone_meshes import StoneWorkshop
from mechanics.scene.laws.table import LawTable, law_table
from mechanics.scene.loads.load import Force, Motion
from mechanics.scene.scene import Block, Fidelity, LawRule, Part, Scene
from mechanics.scene.state import State
from mechanics.stones.meshing.mesh import SolidMesh
from mechanics.stones.meshing.quality import MeshReport
from mechanics.stones.polyhedra import (
    MassProperties,
    alike,
    mass_properties,
    mass_properties_alike,
    united,
)

_PLANE = 1e-6  # largest height of a corner ahead of a face, over the size of its shape [-]; as for meshes
_SAME_VOLUME = (
    1e-6  # largest difference of the volume of a stone's parts from that of its outline, relative [-]
)


@dataclass(frozen=True)
class BodyCorners:
    """Corners of all bodies as the scene gives them, from their centres of mass.

    Attributes
    ----------
    first : (nb+1,) corners of each body
    corner : (n, 3) in body axes [m]
    """

    first: Ints
    corner: Array


@dataclass(frozen=True)
class Model:
    """Constants of a run, packed into arrays.

    Attributes
    ----------
    scene : as given
    fixed, elastic : (nb,) bodies that no force moves, and deformable bodies
    motions : imposed motions, each with the bodies that it drives
    forces : forces, each with the bodies on which it acts
    laws : contact laws, and the pairs of bodies for which they hold
    inertia : of the rigid bodies
    flight : of all bodies that move, the elastic ones by their rigid motion
    mass : (nb,) [kg]
    volume : (nb,) [m³]
    surfaces : for contact detection
    outline : corners of the bodies as the scene gives them
    stones : per body its finite elements; None if it has none
    elastic_stones : the same, packed; equal stones together
    meshes : how the deformable stones were meshed
    """

    scene: Scene
    fixed: Bools
    elastic: Bools
    motions: tuple[tuple[Motion, Ints], ...]
    forces: tuple[tuple[Force, Ints], ...]
    laws: LawTable
    inertia: RigidInertia
    flight: RigidInertia
    mass: Array
    volume: Array
    surfaces: Surfaces
    outline: BodyCorners
    stones: tuple[Deformable | None, ...]
    elastic_stones: ElasticStones
    meshes: MeshReport

    @property
    def rigid_only(self) -> bool:
        """True if no body is deformable."""
        return not bool(self.elastic.any())

    @cached_property
    def lag(self) -> float:
        """Longest time τ in which dashpots of joints and of deformable stones let springs take over [s]."""
        joints = (law.damping_time for law in self.laws.laws)
        stones = (
            block.material.stiffness_damping
            for block in self.scene.blocks
            if block.fidelity is Fidelity.DEFORMABLE
        )
        return max(chain(joints, stones), default=0.0)

    @property
    def mostly_rigid(self) -> bool:
        """True if some bodies deform, and more of those that move do not."""
        return 0 < int(self.elastic.sum()) < int(self.inertia.moving.sum())

    def gravity(self, time: float) -> Array:
        """Return gravity (3,) at a time [m/s²]."""
        gravity = np.array(self.scene.gravity, dtype=float)
        for change in self.scene.loads.gravity:
            gravity = change(time, gravity)
        return gravity

    def nodes_of(self, body: int) -> slice:
        """Return the rows of a body's nodes in State.node."""
        start = self.elastic_stones.start
        return slice(int(start[body]), int(start[body + 1]))


def build_model(
    scene: Scene,
    progress: Callable[[int, int], None] | None = None,
    meshed: tuple[Model, State] | None = None,
) -> tuple[Model, State]:
    """Mesh the deformable stones and pack all bodies; return the model and the state at the start of the scene.

    Stones that deform in `meshed`, built before, keep the mesh that they have there.

    Raises
    ------
    SceneError : if a deformable block has no mesh size, or a fixed one a velocity
    MeshError, GeometryError : if a stone cannot be meshed or its faces do not close
    """
    blocks = scene.blocks
    for block in blocks:
        _check(block)
    volume, centroid, unit_inertia = _mass_properties(blocks)
    stones: list[Deformable | None] = []
    centres = centroid.copy()
    known = {} if meshed is None else _known(*meshed)
    workshop = StoneWorkshop(blocks, scene.contact.alert_distance, scene.time.lumped_mass)
    for index, block in enumerate(blocks):
        if block.fidelity is Fidelity.DEFORMABLE:
            stone, centres[index] = known.get(block.code) or workshop(index)
            stones.append(stone)
        else:
            stones.append(None)
        if progress is not None:
            progress(index + 1, len(blocks))
    packed = elastic_stones(stones)
    inertia = _inertia(blocks, volume, unit_inertia)
    model = Model(
        scene=scene,
        fixed=np.array([block.fidelity is Fidelity.FIXED for block in blocks]),
        elastic=np.array([stone is not None for stone in stones]),
        motions=tuple((motion, _indices(scene, motion.stones)) for motion in scene.loads.motions),
        forces=tuple((force, _indices(scene, force.stones)) for force in scene.loads.forces),
        laws=laws_between(scene),
        inertia=inertia,
        flight=_flight(inertia, stones),
        mass=inertia.mass,
        volume=volume,
        surfaces=_surfaces(blocks, centres, stones, packed.start),
        outline=_outline(blocks, centres),
        stones=tuple(stones),
        elastic_stones=packed,
        meshes=workshop.report(),
    )
    _check_shapes(model)
    _check_loads(model)
    return model, _start(model, centres)


def _known(model: Model, start: State) -> dict[str, tuple[Deformable, Array]]:
    """Return the finite elements and the centre (3,) of the deformable stones of a model, by code."""
    return {
        block.code: (stone, start.centre[body])
        for body, (block, stone) in enumerate(zip(model.scene.blocks, model.stones, strict=True))
        if stone is not None
    }


def _flight(inertia: RigidInertia, stones: list[Deformable | None]) -> RigidInertia:
    """Return the inertia of all bodies that fly."""
    mass, inverse = inertia.mass.copy(), inertia.inverse_mass.copy()
    moments, inverted = inertia.inertia.copy(), inertia.inverse_inertia.copy()
    for b, stone in enumerate(stones):
        if stone is not None:
            mass[b], inverse[b] = stone.mass, 1.0 / stone.mass
            moments[b], inverted[b] = stone.inertia, np.linalg.inv(stone.inertia)
    return RigidInertia(mass, inverse, moments, inverted)


def _parts(block: Block) -> tuple[Part, ...]:
    return block.parts or (Part(block.vertices, block.faces),)


def _mass_properties(blocks: Sequence[Block]) -> tuple[Array, Array, Array]:
    """Return volumes (nb,) [m³], centroids (nb, 3) [m] and inertias (nb, 3, 3) at unit density of all bodies [m⁵]."""
    count = len(blocks)
    volume, centroid, inertia = np.empty(count), np.empty((count, 3)), np.empty((count, 3, 3))
    plain = [b for b, block in enumerate(blocks) if block.radius is None and not block.parts]
    plain_blocks = [blocks[b] for b in plain]
    for faces, rows in alike(
        [block.vertices for block in plain_blocks], [block.faces for block in plain_blocks]
    ):
        bodies = np.array(plain, dtype=np.int64)[rows]
        corners, where = (
            np.stack([plain_blocks[row].vertices for row in rows]),
            [plain_blocks[row].code for row in rows],
        )
        properties = mass_properties_alike(corners, faces, [f"stone {code}" for code in where])
        volume[bodies], centroid[bodies], inertia[bodies] = properties
    for b in sorted(set(range(count)).difference(plain)):
        whole = ball_properties(blocks[b]) if blocks[b].radius is not None else _of_parts(blocks[b])
        volume[b], centroid[b], inertia[b] = whole.volume, whole.centroid, whole.inertia
    return volume, centroid, inertia


def _of_parts(block: Block) -> MassProperties:
    where = f"stone {block.code}"
    whole = united([mass_properties(part.vertices, part.faces, where) for part in block.parts])
    outline = mass_properties(block.vertices, block.faces, where).volume
    if abs(outline - whole.volume) > _SAME_VOLUME * outline:
        raise GeometryError(
            f"its parts have {whole.volume:.6g} m³, its outline {outline:.6g} m³",
            where=where,
            remedy="give convex parts that fill it without overlap",
        )
    return whole


def _outline(blocks: Sequence[Block], centres: Array) -> BodyCorners:
    count = np.array([len(block.vertices) for block in blocks])
    first = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
    corner = np.concatenate([block.vertices for block in blocks]) - np.repeat(centres, count, axis=0)
    return BodyCorners(first, corner)


def _surfaces(
    blocks: tuple[Block, ...], centres: Array, stones: list[Deformable | None], node_ptr: Ints
) -> Surfaces:
    shapes = [(b, part) for b, block in enumerate(blocks) for part in _parts(block)]
    return surfaces(
        [part.vertices - centres[b] for b, part in shapes],
        [part.faces for _, part in shapes],
        [
            mesh
            for b, part in shapes
            for mesh in _face_meshes(blocks[b], part, _mesh_of(stones[b]), centres[b], int(node_ptr[b]))
        ],
        [b for b, _ in shapes],
        [blocks[b].radius or 0.0 for b, _ in shapes],
    )


def _mesh_of(stone: Deformable | None) -> SolidMesh | None:
    return None if stone is None else stone.mesh


def _indices(scene: Scene, codes: frozenset[str]) -> Ints:
    _check_codes(scene, codes, "a load")
    return np.array([b for b, block in enumerate(scene.blocks) if block.code in codes], dtype=np.int64)


def laws_between(scene: Scene) -> LawTable:
    """Return the laws of a scene, and the pairs of bodies between which they hold.

    Raises
    ------
    SceneError : a law names a block that is not there
    """
    rules = [(*_groups(scene, rule), rule.law) for rule in scene.contact.rules]
    return law_table(scene.contact.law, rules, len(scene.blocks), _beds(scene))


def _beds(scene: Scene) -> dict[tuple[int, int], float]:
    """Return the thickness of mortar between two bodies, the lower number first [m].

    What is stated of one block alone holds towards all of which nothing is stated.
    """
    stated = scene.contact.thickness
    outlined = frozenset[str]().union(*stated)
    number = {block.code: b for b, block in enumerate(scene.blocks)}
    others = [b for code, b in number.items() if code not in outlined] if stated else []
    beds = dict[tuple[int, int], float]()
    for pair, thickness in stated.items():
        ends = [number[code] for code in pair if code in number]
        if len(ends) == 2:
            beds[min(ends), max(ends)] = thickness
        elif len(pair) == 1:
            beds |= {(min(end, partner), max(end, partner)): thickness for end in ends for partner in others}
    return beds


def _groups(scene: Scene, rule: LawRule) -> tuple[Bools, Bools]:
    _check_codes(scene, rule.first | rule.second, "a law")
    codes = [block.code for block in scene.blocks]
    first, second = (np.array([code in group for code in codes]) for group in (rule.first, rule.second))
    return first, second


def _check_codes(scene: Scene, codes: frozenset[str], who: str) -> None:
    missing = sorted(codes.difference(block.code for block in scene.blocks))
    if missing:
        raise SceneError(
            f"{who} names {', '.join(missing[:5])}",
            where=scene.name,
            remedy="give codes of blocks of the scene",
        )


def _check_loads(model: Model) -> None:
    codes = [block.code for block in model.scene.blocks]
    driven: set[int] = set()
    for _, bodies in model.motions:
        loose = [codes[b] for b in bodies if not model.fixed[b]]
        if loose:
            raise SceneError(
                f"a motion is imposed on {loose[0]}, which is not fixed",
                where=model.scene.name,
                remedy="make it fixed: an imposed motion leaves a stone no freedom of its own",
            )
        twice = driven.intersection(bodies.tolist())
        if twice:
            raise SceneError(
                f"two motions are imposed on {codes[min(twice)]}", where=model.scene.name, remedy="give one"
            )
        driven.update(bodies.tolist())
    for _, bodies in model.forces:
        constrained = [codes[b] for b in bodies if model.fixed[b] or model.elastic[b]]
        if constrained:
            raise SceneError(
                f"a force acts on {constrained[0]}, which is not rigid",
                where=model.scene.name,
                remedy="forces act on rigid stones",
            )


def _check(block: Block) -> None:
    deformable_ = block.fidelity is Fidelity.DEFORMABLE
    wrong = (
        (
            block.radius is not None and (deformable_ or bool(block.parts)),
            "a ball is deformable or has parts",
            "make it rigid, or a polyhedron",
        ),
        (
            deformable_ and not (block.mesh_size is not None and block.mesh_size > 0),
            f"mesh_size = {block.mesh_size!r} for a deformable stone",
            "give metres greater than 0",
        ),
        (
            block.fidelity is Fidelity.FIXED and any(block.velocity),
            "a fixed stone has a velocity",
            "make it rigid",
        ),
    )
    for is_wrong, what, remedy in wrong:
        if is_wrong:
            raise SceneError(what, where=f"stone {block.code}", remedy=remedy)
    # the facets of a ball are for pictures
    for part in _parts(block) if block.radius is None else ():
        corners = sum(map(len, part.faces))
        if corners > MAX_CORNERS:
            raise GeometryError(
                f"{len(part.faces)} faces with {corners} corners together",
                where=f"stone {block.code}",
                remedy=f"simplify it until its faces have at most {MAX_CORNERS} corners together",
            )


def _check_shapes(model: Model) -> None:
    """Refuse a shape that is not convex, or has faces that are not plane: contacts are found by its planes."""
    shapes, body, radius = model.surfaces.shapes, model.surfaces.body, model.surfaces.radius
    count = np.diff(shapes.fptr)
    owner = np.repeat(np.arange(len(body)), count)
    corners = np.diff(shapes.cptr)
    middle = np.add.reduceat(shapes.vertex[shapes.corner], shapes.cptr[:-1]) / corners[:, None]
    each = np.diff(shapes.vptr)[owner]
    face = np.repeat(np.arange(len(owner)), each)
    vertex = np.arange(len(face)) - np.repeat(np.cumsum(each) - each - shapes.vptr[owner], each)
    ahead = np.einsum("ij,ij->i", shapes.vertex[vertex] - middle[face], shapes.normal[face])
    high = np.maximum.reduceat(ahead, np.cumsum(each) - each)
    extent = np.maximum.reduceat(shapes.vertex, shapes.vptr[:-1]) - np.minimum.reduceat(
        shapes.vertex, shapes.vptr[:-1]
    )
    out = np.where(radius[owner] > 0, 0.0, high / extent.max(axis=1)[owner])
    worst = int(out.argmax())
    if out[worst] > _PLANE:
        number, shape = worst - int(shapes.fptr[owner[worst]]), int(owner[worst])
        part = shape - int(model.surfaces.sptr[body[shape]])
        of_part = f" of part {part}" if model.scene.blocks[body[shape]].parts else ""
        raise GeometryError(
            f"face {number}{of_part} is not plane, or the stone is not convex there: a corner lies {high[worst]:.2g} m "
            "ahead of it",
            where=f"stone {model.scene.blocks[body[shape]].code}",
            remedy="simplify the stone (`simplify_solid` makes faces plane), or give convex parts",
        )


def _inertia(blocks: tuple[Block, ...], volume: Array, unit_inertia: Array) -> RigidInertia:
    density = np.array([block.material.density for block in blocks])
    rigid = np.array([block.fidelity is Fidelity.RIGID for block in blocks])
    mass, inertia = density * volume, density[:, None, None] * unit_inertia
    return RigidInertia(
        mass,
        np.where(rigid, 1.0 / mass, 0.0),
        inertia,
        np.where(rigid[:, None, None], np.linalg.inv(inertia), 0.0),
    )


def _face_meshes(
    block: Block, part: Part, mesh: SolidMesh | None, centre: Array, start: int
) -> Sequence[FaceMesh | None]:
    if mesh is None:
        return [None] * len(part.faces)
    if not block.parts:
        return face_meshes(mesh, len(block.faces), start)
    return part_face_meshes(mesh, part.vertices - centre, part.faces, start)


def _start(model: Model, centres: Array) -> State:
    velocity = np.array([block.velocity for block in model.scene.blocks], dtype=float)
    node = np.zeros((int(model.elastic_stones.start[-1]), 3))
    node_velocity = np.zeros_like(node)
    for body, stone in enumerate(model.stones):
        if stone is not None:
            rows = model.nodes_of(body)
            node[rows] = centres[body] + stone.mesh.nodes
            node_velocity[rows] = velocity[body, :3] + np.cross(velocity[body, 3:], stone.mesh.nodes)
            velocity[body] = 0.0
    rotation = np.tile(np.eye(3), (len(centres), 1, 1))
    return State(0.0, centres.copy(), rotation, velocity, node, node_velocity)
