"""Models of what the mechanics knows: runs, and mechanisms of assessments."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from archmodel.quantities import quantities_of
from archmodel.store.run_record import StoneResult, StructureValues
from archmodel.tables.structures import structure_kinds
from mechanics.arrays import Array, Ints
from mechanics.limit.assembly import RigidAssembly
from mechanics.limit.joints import Resultants
from mechanics.limit.limit_load import Mechanism as Falling
from mechanics.results.contact_result import JointResult
from mechanics.results.result import BodyResult, Frame, Result
from mechanics.scene.scene import Block, Fidelity
from pipelines.reports.page.known import Known
from pipelines.reports.page.model import (
    Column,
    Joints,
    Lines,
    Mechanism,
    Model,
    Motion,
    VertexField,
)
from pipelines.reports.page.surfaces import rigid_motion, stones_of
from pipelines.results.stone_values import joint_values
from pipelines.results.summary import length_tolerance

_MOST = 1_200_000  # stones times instants in a page; of longer runs every second instant, or every third, …
_INSTANTS = 400  # at most
_OF_JOINTS = ("pressure_mean", "pressure_max", "opening", "sliding", "kern", "friction_use", "area")


def with_known(model: Model, known: Known | None) -> Model:
    """Add what a database holds of the stones."""
    if known is None:
        return model
    points = replace(known.points, places=known.points.places - model.origin)
    return replace(
        model,
        columns=(*known.columns, *model.columns),
        relations=known.relations,
        events=known.events,
        points=points,
    )


def run_model(
    result: Result,
    stones: Sequence[StoneResult],
    towards: Array,
    origin: Array,
    known: Known | None = None,
    lines: Sequence[Lines] = (),
    structures: Sequence[StructureValues] = (),
) -> Model:
    """Return the model of a run: motion, joints at the end, results of the stones, and what is known of them.

    Parameters
    ----------
    result, stones : of the run
    towards, origin : (3,) of the assembly
    known : from the database
    lines : further polylines, in the frame of the scene
    structures : results of courses, arches and other structures, shown with their stones
    """
    bodies = result.bodies
    codes = [body.code for body in bodies]
    soft = np.array([body.element is not None for body in bodies])
    mesh, rows = stones_of(codes, [(body.reference, body.faces) for body in bodies], soft.tolist())
    frames = _chosen(result.frames, len(bodies))
    references = [body.reference for body in bodies]
    centres, shift, turn = rigid_motion(references, [frame.positions for frame in frames], soft)
    rest = _rest(bodies, centres, shift[-1], turn[-1], rows)
    fixed = np.array([body.fidelity is Fidelity.FIXED for body in bodies])
    times = np.array([frame.time for frame in frames])
    motion = Motion(times, centres, shift, turn, fixed, rest, _in_time(frames, bodies))
    stress = _stress_field(bodies, rows)
    columns = [*_result_columns(stones), *_structure_columns(codes, structures)]
    model = Model(
        title=result.scene.name,
        stones=mesh,
        columns=columns,
        fields=() if stress is None else (stress,),
        motion=motion,
        joints=_joints(result.joints, centres, shift[-1], turn[-1]),
        lines=lines,
        colour="von_mises" if stress is not None else _first_colour(result, columns),
        towards=towards,
        origin=origin,
        notes=_notes(len(frames), len(result.frames), bool(soft.any())),
    )
    return with_known(model, known)


def _notes(shown: int, frames: int, elastic: bool) -> list[str]:
    """Return notes on instants that are not shown, and on what is shown of the last instant alone."""
    notes = []
    if shown < frames:
        notes.append(f"{shown} of {frames} instants are in this page; results.vtkhdf has them all.")
    if elastic:
        notes.append(
            "Stress on the surface and the deformation of elastic stones are those of the last instant."
        )
    return notes


def _first_colour(result: Result, columns: Sequence[Column]) -> str:
    """Return the displacement; of stones that have not moved, what their joints carry, where they carry anything."""
    still = all(np.abs(body.displacement).max() < length_tolerance(result) for body in result.bodies)
    carried = any(column.name == "joint_pressure" for column in columns)
    return "joint_pressure" if still and carried else "displacement"


def assessment_model(
    name: str,
    blocks: Sequence[Block],
    on: RigidAssembly,
    limits: Sequence[tuple[str, str, Falling, Resultants | None]],
    towards: Array,
    origin: Array,
    known: Known | None = None,
) -> Model:
    """Return the model of an assessment: the mechanism of each load, with the resultants of the joints at its limit.

    Parameters
    ----------
    limits : name of the load, its answer in a sentence, mechanism, and resultants if anything balances
    """
    codes = [block.code for block in blocks]
    mesh, _ = stones_of(codes, [(block.vertices, block.faces) for block in blocks])
    centres = np.asarray(on.state.centre)
    mechanisms = [
        Mechanism(
            load, about, centres, moving.velocity, None if carried is None else _resultants(on, carried)
        )
        for load, about, moving, carried in limits
    ]
    model = Model(
        title=name,
        stones=mesh,
        mechanisms=mechanisms,
        colour="kind" if known is not None else None,
        towards=towards,
        origin=origin,
    )
    return with_known(model, known)


def _chosen(frames: Sequence[Frame], stones: int) -> list[Frame]:
    """Return the instants that a page holds: the first, the last, and evenly between."""
    most = int(np.clip(_MOST // max(stones, 1), 2, _INSTANTS))
    rows = np.unique(np.linspace(0, len(frames) - 1, min(len(frames), most)).round().astype(int))
    return [frames[row] for row in rows.tolist()]


def _rest(
    bodies: Sequence[BodyResult], centres: Array, shift: Array, turn: Array, rows: Ints
) -> Array | None:
    """Return the displacement (nv, 3) of the vertices at the end beyond that of rigid stones; None if all are."""
    if all(body.element is None for body in bodies):
        return None
    matrices = _matrices(turn)
    beyond = [
        np.zeros_like(body.reference)
        if body.element is None
        else body.position - (body.reference - centre) @ matrix.T - centre - moved
        for body, centre, matrix, moved in zip(bodies, centres, matrices, shift, strict=True)
    ]
    rest: Array = np.concatenate(beyond)[rows]
    return rest


def _matrices(turn: Array) -> Array:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(turn).as_matrix())


def _stress_field(bodies: Sequence[BodyResult], rows: Ints) -> VertexField | None:
    if all(body.von_mises is None for body in bodies):
        return None
    values = np.concatenate(
        [
            np.full(len(body.reference), np.nan) if body.von_mises is None else body.von_mises
            for body in bodies
        ]
    )
    return VertexField("von_mises", "Von Mises stress", "Pa", values[rows].astype(np.float32))


def _in_time(frames: Sequence[Frame], bodies: Sequence[BodyResult]) -> list[tuple[str, str, Array]]:
    """Return the largest Von Mises stress of each stone in each instant, where there is any."""
    if all(body.von_mises is None for body in bodies) or len(frames) < 3:
        return []
    values = np.full((len(frames), len(bodies)), np.nan)
    for row, frame in enumerate(frames):
        for column, stress in enumerate(frame.stresses):
            if stress is not None:
                values[row, column] = _von_mises(stress).max()
    return [("largest Von Mises stress", "Pa", values)]


def _von_mises(stress: Array) -> Array:
    xx, yy, zz, xy, yz, zx = stress.T
    shear = 3.0 * (xy**2 + yz**2 + zx**2)
    value: Array = np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + shear)
    return value


def _result_columns(stones: Sequence[StoneResult]) -> list[Column]:
    """Return the results of the stones, those of which any stone has a value."""

    found = [Column("fidelity", "modelled as", None, [stone.fidelity for stone in stones], "Results")]
    for name, quantity in quantities_of("stone").items():
        given = [stone.values.get(name, getattr(stone, name, None)) for stone in stones]
        values = np.array([np.nan if value is None else value for value in given], dtype=float)
        if np.isfinite(values).any():
            found.append(Column(name, quantity.label, quantity.unit, values, "Results"))
    return found


def _structure_columns(codes: Sequence[str], structures: Sequence[StructureValues]) -> list[Column]:
    """Return the results of the structures of each stone; of several of a kind, the largest."""
    values: dict[tuple[str, str], dict[str, float]] = {}
    for structure in structures:
        for name, value in structure.values.items():
            stones = values.setdefault((structure.kind, name), {})
            stones |= {code: max(value, stones.get(code, value)) for code in structure.members}
    return [
        Column(
            f"{kind}_{name}",
            f"{quantities_of(*structure_kinds(), kind)[name].label} of its {kind.replace('_', ' ')}",
            quantities_of(*structure_kinds(), kind)[name].unit,
            np.array([stones.get(code, np.nan) for code in codes]),
            "Results",
        )
        for (kind, name), stones in values.items()
    ]


def _joints(joints: JointResult, centres: Array, shift: Array, turn: Array) -> Joints:
    """Return the joints at the end, each where its second stone was at the start."""
    second = joints.bodies[:, 1]
    matrices = _matrices(turn)

    def back(places: Array, body: Ints) -> Array:
        """Return places on displaced bodies where they were before the run [m]."""
        away = places - centres[body] - shift[body]
        place: Array = np.einsum("nji,nj->ni", matrices[body], away) + centres[body]
        return place

    counts = [len(one) for one in joints.polygon]
    corners = back(np.concatenate([np.zeros((0, 3)), *joints.polygon]), np.repeat(second, counts))
    values = joint_values(joints, slivers=False)
    columns = [_column(name, values[name]) for name in _OF_JOINTS]
    return Joints(
        joints.bodies,
        np.split(corners, np.cumsum(counts)[:-1]) if counts else [],
        back(joints.centre_of_pressure, second),
        joints.force,
        joints.kern,
        columns,
    )


def _resultants(on: RigidAssembly, carried: Resultants) -> Joints:
    section = on.joints.section
    columns = [
        _column("force_normal", carried.normal),
        _column("force_shear", carried.shear),
        _column("kern", carried.kern),
        _column("friction_use", carried.friction_use),
    ]
    return Joints(on.joints.bodies, section.polygons(), carried.place, carried.force, carried.kern, columns)


def _column(name: str, values: Array) -> Column:
    """Return the column of a result of joints."""
    quantity = quantities_of("joint")[name]
    return Column(name, quantity.label, quantity.unit, values)
