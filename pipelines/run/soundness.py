"""Problems of a scene that make its result worthless; `moma check` lists them, and `moma run` refuses them."""

from collections.abc import Sequence
from dataclasses import replace

from ground.errors import GeometryError, UnsoundSceneError
from mechanics.model.model import build_model
from mechanics.results.forecast.plan import loose_blocks
from mechanics.scene.loads.load import Loads
from mechanics.scene.scene import Fidelity, Scene
from pipelines.run.assemble import Assembly
from pipelines.run.plausibility import impossible_values
from pipelines.scene.file import SceneFile
from survey.conventions import LISTED, PER_MILLE
from survey.geometry.solids import Solid
from survey.geometry.watertight import check_watertight, doubtful_solids
from survey.joints.settings import JointMode

DEEP = 0.005  # overlap [m]; less is survey noise, which the contacts absorb
_LEVEL = PER_MILLE  # over the height of all stones, by which bottoms in one level differ [-]


def problems_of(scene: SceneFile, assembly: Assembly, loose: Sequence[str]) -> tuple[str, ...]:
    """Return all problems of a scene; none if it is sound.

    Parameters
    ----------
    scene : its file
    assembly : the scene, and how it came about
    loose : codes of the stones that no chain of touching stones ties to a fixed one (`loose_blocks`)
    """
    return (
        *impossible_values(scene, assembly.models),
        *unsound_stones(assembly),
        *(_without_rig(assembly.scene) if in_rig(scene, assembly) else unsupported(assembly.scene, loose)),
    )


def in_rig(scene: SceneFile, assembly: Assembly) -> bool:
    """Return whether the stones stand on the base of a test rig alone."""
    return scene.pushover is not None and stands_alone(assembly.scene)


def _without_rig(scene: Scene) -> list[str]:
    """Return the problem of stones that only a rig holds, and the stones that would stand on the ground instead."""
    bottoms = {block.code: float(block.vertices[:, 2].min()) for block in scene.blocks}
    tall = max(float(block.vertices[:, 2].max()) for block in scene.blocks) - min(bottoms.values())
    lowest = [code for code, z in bottoms.items() if z <= min(bottoms.values()) + _LEVEL * tall]
    codes = ", ".join(f'"{code}"' for code in lowest)
    return [
        "no stone is fixed: only the rig of `moma pushover` has a base; to run the stones under their weight alone, "
        f"fix the lowest: [bodies] fixed = [{codes}]"
    ]


def caution_of(problems: Sequence[str]) -> str:
    """Return the caution that goes with the outcome of a scene that was run in spite of its problems."""
    return f"run although the scene is unsound: {_facts(problems)}"


_ALL_THE_SAME = "or run it all the same with --accept-unsound, which marks all its results"


def refuse_unsound(problems: Sequence[str], where: str, remedy: str = _ALL_THE_SAME) -> None:
    """Refuse a scene that has problems.

    Raises
    ------
    UnsoundSceneError : with all problems and their remedies
    """
    if problems:
        listed = (
            problems if len(problems) == 1 else [f"({i}) {problem}" for i, problem in enumerate(problems, 1)]
        )
        raise UnsoundSceneError(
            f"the scene is unsound: {'; '.join(listed)}",
            where=where,
            remedy=remedy,
        )


def unsound_stones(assembly: Assembly) -> list[str]:
    """Return the problems of the stones and of their joints, as far as they are known without contacts."""
    return [
        *_unsound_solids(assembly.scene),
        *_unclosed(assembly),
        *_alone(assembly),
        *_overlapping(assembly),
    ]


def _unsound_solids(scene: Scene) -> list[str]:
    problems = []
    solids = [Solid(block.code, block.vertices, block.faces) for block in scene.blocks]
    convex = [not block.parts for block in scene.blocks]
    for number in doubtful_solids(solids, convex):
        try:
            check_watertight(solids[number], convex=convex[number])
        except GeometryError as error:
            problems.append(str(error))
    return problems


def _unclosed(assembly: Assembly) -> list[str]:
    """Report stones whose joints all stay open although they were to be closed."""
    if assembly.closing.mode is JointMode.AS_SURVEYED:
        return []
    fixed = {block.code for block in assembly.scene.blocks if block.fidelity is Fidelity.FIXED}
    closed = {code for joint in assembly.closing.joints if not joint.left_open for code in joint.stones}
    open_stones = {
        code: joint.left_open
        for joint in reversed(assembly.closing.joints)
        for code in joint.stones
        if joint.left_open and code not in closed | fixed
    }
    if not open_stones:
        return []
    first = min(open_stones)
    return [
        f"no joint of these could be closed: {some(sorted(open_stones))}; of {first}, {open_stones[first]}; look at "
        "the survey there, or allow more by max_displacement in [joints]"
    ]


def _alone(assembly: Assembly) -> list[str]:
    """Report stones, neither thrown nor fixed, that face no other across a joint."""
    if assembly.closing.mode is JointMode.AS_SURVEYED or len(assembly.models) == 1:
        return []
    alone = set(assembly.closing.alone)
    loose = [
        block.code
        for block in assembly.scene.blocks
        if block.code in alone and block.fidelity is not Fidelity.FIXED and not any(block.velocity)
    ]
    if not loose:
        return []
    return [
        f"these face no other stone across a joint: {some(sorted(loose))}; look at max_width, max_angle and "
        "min_overlap in [joints], or leave them out"
    ]


def _overlapping(assembly: Assembly) -> list[str]:
    """Report stones that initially overlap deeply and would be driven apart."""
    deep = [overlap for overlap in assembly.closing.overlaps if overlap.depth > DEEP]
    return [
        f"{' and '.join(pair.stones)} lie {pair.depth * 1e3:.0f} mm in each other; measure them again, or exclude one"
        for pair in sorted(deep, key=lambda overlap: -overlap.volume)[:LISTED]
    ]


def unsupported(scene: Scene, loose: Sequence[str]) -> list[str]:
    """Return a problem where nothing can support stones; usually a selection or a joint is not as intended.

    Parameters
    ----------
    scene : the scene
    loose : codes of the stones that no chain of touching stones ties to a fixed one
    """
    if stands_alone(scene):
        return ['no stone is fixed, so nothing holds the others; give [bodies] fixed, e.g. ["course = 1"]']
    thrown = {block.code for block in scene.blocks if any(block.velocity)}
    falling = [code for code in loose if code not in thrown]
    if not falling:
        return []
    return [
        f"no chain of touching stones ties these to a fixed one: {some(falling)}; they will fall: "
        "stones that share an edge or a corner alone do not bear one another"
    ]


def stands_alone(scene: Scene) -> bool:
    """Return True where no stone is fixed, so that only a test rig could hold the stones."""
    return all(block.fidelity is not Fidelity.FIXED for block in scene.blocks)


def unsupported_stages(scene: SceneFile, assembly: Assembly) -> list[str]:
    """Return a remark for each stage of building in which nothing ties stones to a fixed or held one, with its line."""
    remarks = []
    for entry, stage in zip(scene.stages, assembly.stages, strict=True):
        # what touches does not depend on meshes
        loose = loose_blocks(*build_model(replace(stage.scene.rigid, loads=Loads())))
        if loose:
            remarks.append(
                f"{scene.document.where(*entry.path)}: in stage {stage.name!r} no chain of touching stones ties these "
                f"to a fixed or held one: {some(loose)}; they will fall, unless what has moved lies beneath them"
            )
    return remarks


def some(codes: Sequence[str]) -> str:
    """Return the first codes, and how many others there are."""
    more = f" and {len(codes) - LISTED} more" if len(codes) > LISTED else ""
    return ", ".join(codes[:LISTED]) + more


def _facts(problems: Sequence[str]) -> str:
    """Return the first problem without its remedy, and the number of the others."""
    first, more = problems[0].split("; ")[0], len(problems) - 1
    return first + (f" (and {more} more problem{'s' if more > 1 else ''})" if more else "")


def unfinished_loads(assembly: Assembly) -> tuple[str, ...]:
    """Return in words the loads that are not over when a run ends, first those whose peak or strong part it misses."""
    scenes = [stage.scene for stage in assembly.stages] or [assembly.scene]
    missed = [load for built in scenes for load in built.loads.unfinished(built.time.duration, True)]
    others = [load for built in scenes for load in built.loads.unfinished(built.time.duration, False)]
    return tuple(dict.fromkeys((*missed, *others)))
