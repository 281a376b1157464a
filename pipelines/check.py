"""Is a scene sound, and what will it cost: everything that can be known before it runs."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from archmodel.database import open_database
from mechanics.plan import Plan, plan
from mechanics.scene import Fidelity, Scene
from moma.errors import GeometryError, MeshError
from pipelines.assemble import assemble_stones
from pipelines.entries import describe
from pipelines.scenefile import read_scene
from pipelines.selection import select_groups, select_stones
from survey.closing_report import ClosingReport
from survey.solids import Solid
from survey.watertight import check_watertight

__all__ = ["CheckReport", "Cost", "JointsReport", "MaterialUse", "MeshUse", "check_scene"]


@dataclass(frozen=True)
class MaterialUse:
    """A material and how many stones are of it."""

    name: str
    density: float
    young: float
    poisson: float
    stones: int


@dataclass(frozen=True)
class MeshUse:
    """Finite elements of one kind and target edge length [m], and how many stones are of them."""

    element: str
    size: float
    stones: int


@dataclass(frozen=True)
class JointsReport:
    """What closing the joints changes.

    Attributes
    ----------
    count : joints
    mean_width : how wide they were open on average [m]
    max_displacement : largest movement of a corner [m], of `worst_stone`
    max_volume_change : largest relative change of a volume [-]
    displacement : largest movement of a corner of each stone [m]
    """

    count: int
    mean_width: float
    max_displacement: float
    worst_stone: str
    max_volume_change: float
    displacement: Mapping[str, float]


@dataclass(frozen=True)
class Cost:
    """What a run will need.

    Attributes
    ----------
    pairs : touching pairs of stones
    contacts : contact points at the start
    unknowns : velocities
    memory : [bytes], estimated
    steps : at most
    step : [s]
    """

    pairs: int
    contacts: int
    unknowns: int
    memory: int
    steps: int
    step: float


@dataclass(frozen=True)
class CheckReport:
    """The plan of a scene; it is sound if there are no problems. Laws and loads are told in words."""

    scene: str
    kinds: Mapping[str, int]
    bodies: Mapping[str, int]
    materials: tuple[MaterialUse, ...]
    meshes: tuple[MeshUse, ...]
    joints: JointsReport | None
    cost: Cost | None
    laws: tuple[str, ...]
    loads: tuple[str, ...]
    problems: tuple[str, ...]


def check_scene(path: str | Path, url: str) -> CheckReport:
    """Check a scene file against a database, without running anything.

    What is wrong with the file itself is raised; what is wrong with the stones is in the report.

    Raises
    ------
    SceneError : the file is wrong, or an expression names no stone
    DatabaseError : the database cannot be read
    """
    scene = read_scene(path)
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        models = select_stones(scene, session)
        groups = select_groups(scene, session, models)
    kinds = Counter(model.record.kind for model in models)
    bodies = Counter(str(model.fidelity) for model in models)
    uses = Counter(model.material for model in models)
    problems: list[str] = []
    joints, cost = None, None
    meshes: tuple[MeshUse, ...] = ()
    try:
        assembly = assemble_stones(scene, models, groups)
        joints = _joints(assembly.closing)
        meshes = _meshes(assembly.scene)
        problems += _unsound_solids(assembly.scene)
        needs = plan(assembly.scene)
        cost = _cost(needs, assembly.scene)
        problems += _unsupported(needs)
    except (GeometryError, MeshError) as error:
        problems.append(str(error))
    return CheckReport(
        scene=scene.name,
        kinds=dict(sorted(kinds.items())),
        bodies={str(one): bodies[str(one)] for one in Fidelity},
        materials=tuple(
            MaterialUse(one.name, one.density, one.young, one.poisson, count) for one, count in uses.items()
        ),
        meshes=meshes,
        joints=joints,
        cost=cost,
        laws=tuple(describe(one.entry, groups) for one in scene.laws),
        loads=tuple(describe(entry, groups) for entry in (*scene.loads, *scene.throws)),
        problems=tuple(problems),
    )


def _meshes(scene: Scene) -> tuple[MeshUse, ...]:
    uses = Counter(
        (str(block.element), block.mesh_size) for block in scene.blocks if block.mesh_size is not None
    )
    return tuple(MeshUse(element, size, count) for (element, size), count in uses.items())


def _joints(closing: ClosingReport) -> JointsReport:
    moved = {code: float(one.max()) for code, one in closing.displacement.items()}
    worst = max(moved, key=lambda code: moved[code])
    widths = [joint.width for joint in closing.joints]
    return JointsReport(
        count=len(closing.joints),
        mean_width=float(np.mean(widths)) if widths else 0.0,
        max_displacement=moved[worst],
        worst_stone=worst,
        max_volume_change=max(abs(change) for change in closing.volume_change.values()),
        displacement=moved,
    )


def _unsound_solids(scene: Scene) -> list[str]:
    problems = []
    for block in scene.blocks:
        try:
            check_watertight(Solid(block.code, block.vertices, block.faces), convex=True)
        except GeometryError as error:
            problems.append(str(error))
    return problems


def _cost(needs: Plan, scene: Scene) -> Cost:
    return Cost(
        pairs=len(needs.pairs),
        contacts=needs.contacts,
        unknowns=needs.unknowns,
        memory=needs.memory,
        steps=max(1, round(scene.time.duration / scene.time.step)),
        step=scene.time.step,
    )


def _unsupported(needs: Plan) -> list[str]:
    """Stones that nothing can hold; mostly a selection or a joint is not what was meant."""
    if not needs.bodies[Fidelity.FIXED]:
        return ['no stone is fixed, so nothing holds the others; give [bodies] fixed, e.g. ["course = 1"]']
    if not needs.loose:
        return []
    named = ", ".join(needs.loose[:6]) + (f" and {len(needs.loose) - 6} more" if len(needs.loose) > 6 else "")
    return [f"no chain of touching stones ties these to a fixed one: {named}; they will fall"]
