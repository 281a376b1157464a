"""Soundness and cost of a scene, as far as they can be known before it runs."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path

from archmodel.database.session import open_database
from ground.errors import GeometryError, MeshError
from mechanics.dynamics.progress import Listener, Progress, silent
from mechanics.results.forecast.cost import expected_cost, machine_slowness
from mechanics.results.forecast.plan import Plan, plan
from mechanics.scene.scene import Fidelity, Scene
from mechanics.stones.meshing.quality import MeshReport
from pipelines.draw.closing_pictures import draw_closing
from pipelines.draw.elevations.closing_shapes import ClosingShapes, Stages, closing_shapes
from pipelines.results.folder import check_replaceable, replacing, source_of
from pipelines.results.summary import as_json
from pipelines.run.assemble import Assembly, assemble_stones, wishes_of
from pipelines.run.check_report import (
    CheckReport,
    Cost,
    MaterialUse,
    MeshQualityReport,
    MeshUse,
    StoneModelling,
)
from pipelines.run.closing_check import joints_report, simplification_report
from pipelines.run.fidelity import Modelled, modelled
from pipelines.run.filling import filling
from pipelines.run.inputs import stage_lines
from pipelines.run.plausibility import corner_warnings, depth_warnings, impossible_values, unusual_values
from pipelines.run.run import USUAL
from pipelines.run.soundness import (
    in_rig,
    unfinished_loads,
    unsound_stones,
    unsupported,
    unsupported_stages,
)
from pipelines.scene.array_tables import describe
from pipelines.scene.file import SceneFile, read_scene
from pipelines.scene.rig_cautions import rig_cautions
from pipelines.scene.selection import Groups, StoneModel, select_groups, select_stones
from pipelines.tuning.profiles import with_profile
from survey.geometry.solids import Solid
from survey.simplify.simplify import BlockyStone

_INDEX = "check.json"
# processor time of a run besides its simulation, on the machine of `cost_rates`:
_PROGRAM = 12.0  # the program and its kernels are loaded, the report is written [s]
_STONE = 3e-3  # a stone is read, its joints are closed, its results are written and stored [s]
_PICTURE = 5.0  # a picture is drawn by a program of its own [s]
_SPREAD = 2.0  # factor within which these lie [-]
_LIBRARIES = 280_000_000  # memory of the libraries that read, draw and store [bytes]


_IN_RIG = (
    "no stone is fixed: only `moma pushover` can use the scene, whose rig has a base; it also finds whether the stones "
    "rest under the vertical force, and names those that do not"
)


def check_scene(
    path: str | Path,
    url: str,
    pictures: Path | None = None,
    profile: str | None = None,
    progress: Listener = silent,
    overwrite: bool = False,
) -> CheckReport:
    """Check a scene file against a database, without running anything.

    Mistakes in the file are raised; problems with the stones are in the report.

    Parameters
    ----------
    path : of the scene file
    url : of the database
    pictures : folder for pictures of the stones and their joints, and for the report as ``check.json``; None: none
    profile : name of the profile whose settings take precedence over the scene's; None: the scene as written
    progress : called at every stage
    overwrite : replace the pictures of another scene in the folder

    Raises
    ------
    SceneError : the file is wrong, or an expression names no stone
    DatabaseError : the database cannot be read
    UsageError : the folder holds other files, or those of another scene, or there is no such profile
    """
    if pictures is not None:
        check_replaceable(pictures, _INDEX, () if overwrite else (Path(path),))
    scene = read_scene(path)
    progress(Progress("blocks", 0, None, "reading the stones"))
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        models = select_stones(scene, session)
        scene = with_profile(scene, profile, models)
        groups = select_groups(scene, session, models)
    problems = impossible_values(scene, models)
    assembly, needs = None, None
    progress(Progress("blocks", 0, None, f"closing the joints of {len(models)} stones"))
    try:
        assembly = assemble_stones(scene, models, groups)
        problems += unsound_stones(assembly)
        progress(Progress("check", 0, None, "meshes, and contacts at the start"))
        needs = plan(assembly.scene)
        if not in_rig(scene, assembly):
            problems += unsupported(assembly.scene, needs.loose)
    except (GeometryError, MeshError) as error:
        problems.append(str(error))
    report = _report(scene, models, groups, assembly, needs, tuple(problems))
    if pictures is None or assembly is None:
        return report
    progress(Progress("write", 0, None, "pictures"))
    return _with_pictures(report, assembly, pictures, Path(path))


def _with_pictures(report: CheckReport, assembly: Assembly, folder: Path, scene: Path) -> CheckReport:
    """Draw the pictures into the folder, all of them or none; return the report that lists them."""
    with replacing(folder, _INDEX) as fresh:
        files, warnings = draw_closing(fresh, _shapes(report.scene, assembly))
        report = replace(
            report,
            files=(*files, _INDEX),
            warnings=(*report.warnings, *warnings),
            source=tuple(source_of([scene], fresh)),
        )
        (fresh / _INDEX).write_text(as_json(asdict(report)), encoding="utf-8")
    return report


def _of_rig(scene: SceneFile, assembly: Assembly) -> list[str]:
    """Return the warnings about a loading test that the scene asks for."""
    if scene.pushover is None:
        return []
    alone = [_IN_RIG] if in_rig(scene, assembly) else []
    return [*rig_cautions(assembly.scene, scene.pushover.rig, scene.pushover.step), *alone]


def _simplified(assembly: Assembly) -> list[BlockyStone]:
    """Return the simplified stones; those that grew from their outlines are as surveyed."""
    grown = {code for leaf in assembly.closing.leaves for code in leaf.grown}
    return [stone for stone in assembly.simplified if stone.code not in grown]


def _hypotheses(assembly: Assembly) -> frozenset[str]:
    return frozenset(model.record.code for model in assembly.models if model.record.hypothesis)


def _shapes(scene: str, assembly: Assembly) -> ClosingShapes:
    """Return the content of the pictures, about the local origin of the scene."""
    records = [model.record for model in assembly.models]
    return closing_shapes(
        scene,
        Stages(
            surveyed=[
                Solid(record.code, record.solid_vertices - assembly.origin, record.solid_faces)
                for record in records
            ],
            simple=[stone.solid for stone in assembly.simplified],
            closed=[Solid(block.code, block.vertices, block.faces) for block in assembly.scene.blocks],
        ),
        simplified={stone.code: stone.report.displacement for stone in assembly.simplified},
        closing=assembly.closing,
        faces=[record.outline - assembly.origin for record in records],
        hypotheses=_hypotheses(assembly),
        core=frozenset(record.code for record in records if record.kind == "infill"),
    )


def _report(
    scene: SceneFile,
    models: Sequence[StoneModel],
    groups: Groups,
    assembly: Assembly | None,
    needs: Plan | None,
    problems: tuple[str, ...],
) -> CheckReport:
    """Return the report; it says less where stones could not be assembled, or the scene not be meshed."""
    kinds = Counter(model.record.kind for model in models)
    chosen = _modelled(scene, models, groups) if assembly is None else assembly.modelled
    bodies = Counter(str(model.fidelity) for model in chosen.values())
    uses = Counter(model.material for model in models)
    return CheckReport(
        scene=scene.name,
        kinds=dict(sorted(kinds.items())),
        bodies={str(fidelity): bodies[str(fidelity)] for fidelity in Fidelity},
        ring=sum(model.ring > 0 for model in chosen.values()),
        stones=tuple(
            StoneModelling(code, str(choice.fidelity), choice.reason, choice.stress)
            for code, choice in chosen.items()
        ),
        materials=tuple(
            MaterialUse(key.name, key.density, key.young, key.poisson, count) for key, count in uses.items()
        ),
        meshes=() if assembly is None else _meshes(assembly.scene),
        mesh_quality=None if needs is None else _mesh_quality(needs.meshes),
        simplification=None if assembly is None else simplification_report(_simplified(assembly)),
        joints=None
        if assembly is None
        else joints_report(assembly.closing, assembly.origin, _hypotheses(assembly)),
        cost=None
        if assembly is None or needs is None
        else _cost(
            needs, assembly.scene, len(USUAL if scene.output.pictures is None else scene.output.pictures)
        ),
        laws=tuple(describe(law.entry, groups) for law in scene.laws),
        loads=tuple(describe(entry, groups) for entry in (*scene.loads, *scene.throws)),
        stages=() if assembly is None else stage_lines(scene, assembly),
        filling=None if assembly is None else filling(scene, assembly),
        problems=problems,
        warnings=(
            *unusual_values(scene, models),
            *corner_warnings(models),
            *depth_warnings(models),
            *(() if assembly is None else assembly.remarks),
            *(() if assembly is None else unsupported_stages(scene, assembly)),
            *(() if assembly is None else _of_rig(scene, assembly)),
        ),
        cautions=() if assembly is None else unfinished_loads(assembly),
    )


def _modelled(scene: SceneFile, models: Sequence[StoneModel], groups: Groups) -> Mapping[str, Modelled]:
    """Return the models of stones whose joints are unknown."""
    return modelled([model.record.code for model in models], {}, wishes_of(scene, models, groups))


def _meshes(scene: Scene) -> tuple[MeshUse, ...]:
    uses = Counter(
        (str(block.element), block.mesh_size) for block in scene.blocks if block.mesh_size is not None
    )
    return tuple(MeshUse(element, size, count) for (element, size), count in uses.items())


def _mesh_quality(meshes: MeshReport) -> MeshQualityReport | None:
    sharpest, worst = meshes.sharpest, meshes.worst
    if sharpest is None or worst is None:
        return None
    return MeshQualityReport(
        nodes=meshes.nodes,
        cells=meshes.cells,
        distinct=meshes.distinct,
        how=meshes.how,
        smallest_angle=sharpest.quality.min_dihedral,
        sharpest=sharpest.code,
        smallest_jacobian=worst.quality.min_scaled_jacobian,
        worst=worst.code,
        retried={stone.code: stone.failures for stone in meshes.retried},
    )


def _cost(needs: Plan, scene: Scene, pictures: int) -> Cost:
    """Return the expected cost of the whole command, with so many pictures."""
    slowness = machine_slowness()
    expected = expected_cost(needs, scene, slowness)
    beside = slowness * (_PROGRAM + _STONE * needs.amounts.stones + _PICTURE * pictures)
    least, usual, most = expected.seconds
    low, likely, high = beside / _SPREAD + least, beside + usual, _SPREAD * beside + most
    return Cost(
        pairs=len(needs.pairs),
        open_pairs=needs.open_pairs[0],
        widest=needs.open_pairs[1],
        contacts=needs.contacts,
        unknowns=needs.unknowns,
        memory=needs.memory,
        steps=scene.time.steps,
        step=scene.time.step,
        seconds=(low, likely, high),
        longest=beside + expected.longest,
        unknown=expected.unknown,
        peak=expected.memory + _LIBRARIES,
    )
