"""A synthetic survey with a scene that runs, written into a folder for people to start from."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import settlement
from mechanics.scene.scene import Block, Fidelity, Scene, Start, TimeSettings
from mechanics.simulate import simulate
from mechanics.stones.materials import Material
from moma.errors import UsageError
from pipelines.arrays import Array
from survey.formats.native.writer import write_head, write_moma
from survey.formats.solids.obj_writer import write_obj
from survey.synthetic.frame import Movement, RigidMotion
from survey.synthetic.samples import SAMPLES, Cause, SampleRecipe

__all__ = ["WrittenSample", "write_sample"]

_SCENE = """\
# {title}: synthetic, no such building exists. Every key is explained in docs/scene.md.
{commands}
[scene]
name = "{title} (synthetic)"

# A sound limestone; synthetic values, like the survey.
[materials.limestone]
density = 2350.0   # kg/m³
young = 12e9       # Pa
poisson = 0.2
{core}
[bodies]
default = "rigid"
fixed = ["{fixed}"]

[joints]
max_width = 0.04   # m

[contact]
friction = 0.6

[time]
start = "equilibrium"  # found at once; the steps then show that it lasts
step = 0.005       # s
theta = 1.0
duration = {duration}     # s
relaxation = true  # only where it comes to rest is asked for
{loads}
[output]
pictures = ["displacement", "pressure"]
"""

_SETTLEMENT = """
[[loads]]
type = "settlement"
stones = ["{code}"]
displacement = [0.0, 0.0, {height}]
duration = {duration}
"""
_HEAD = "head.moma"  # header file of closed solids
_DURATION = 1.0  # of settlements [s]
_LONGEST = 3.0  # of their simulation [s]

_CORE = """
# Mortar and small stones between the facings.
[materials.core]
stones = ["kind = infill"]
density = 1900.0
young = 1e9
poisson = 0.2
"""


@dataclass(frozen=True)
class WrittenSample:
    """Files of a sample.

    Attributes
    ----------
    kind, title : the sample
    stones : their number in the survey
    files : paths of the survey, its truth, the scene, what is known besides, and stones that are closed solids
    commands : that take the survey to the results of the scene, in order
    """

    kind: str
    title: str
    stones: int
    files: tuple[str, ...]
    commands: tuple[str, ...]


def write_sample(kind: str, folder: Path) -> WrittenSample:
    """Write KIND.moma, truth.json and KIND.toml into a folder, created if necessary.

    Some come with knowledge.toml, and with solids.obj and its head.moma.

    Parameters
    ----------
    kind : name of the sample
    folder : in which none of these files exists

    Raises
    ------
    UsageError
        if there is no such sample, or a file would be overwritten
    """
    if kind not in SAMPLES:
        raise UsageError(f"no sample {kind!r}", remedy=f"the samples are {', '.join(SAMPLES)}")
    recipe = SAMPLES[kind]
    cause = recipe.cause
    sample = recipe.make() if cause is None else cause.sample(_movement(cause))
    survey, scene = folder / f"{kind}.moma", folder / f"{kind}.toml"
    knowledge = folder / "knowledge.toml" if sample.knowledge else None
    solids = folder / "solids.obj" if sample.modelled else None
    commands = tuple(_commands(recipe, survey, solids, knowledge, scene))
    texts = {folder / "truth.json": sample.truth, scene: _scene(recipe, commands)}
    if knowledge is not None:
        texts[knowledge] = sample.knowledge
    extra = () if solids is None else (solids, solids.with_name(_HEAD))
    for path in (survey, *texts, *extra):
        if path.exists():
            raise UsageError(f"{path} exists", remedy="name another folder: --out DIR")
    folder.mkdir(parents=True, exist_ok=True)
    write_moma(sample.survey, survey)
    for path, text in texts.items():
        path.write_text(text, encoding="utf-8", newline="\n")
    if solids is not None:
        write_obj(sample.modelled, solids)
        head = sample.survey.head
        write_head(replace(head, name=f"{head.name}, closed solids"), solids.with_name(_HEAD))
    files = tuple(str(path) for path in (survey, *texts, *extra))
    stones = len(sample.survey.blocks) + len(sample.modelled)
    return WrittenSample(kind, recipe.title, stones, files, commands)


def _scene(recipe: SampleRecipe, commands: Sequence[str]) -> str:
    return _SCENE.format(
        title=recipe.title,
        commands="".join(f"#   {command}\n" for command in commands),
        core=_CORE if recipe.core else "",
        fixed=recipe.fixed,
        duration=1.0 if recipe.cause is None else _LONGEST,
        loads="" if recipe.cause is None else "".join(_loads(recipe.cause)),
    )


def _loads(cause: Cause) -> Iterator[str]:
    yield "\n# What moved it: the same as in the truth.\n"
    for code, height in cause.settlement.items():
        yield _SETTLEMENT.format(code=code, height=height, duration=_DURATION)


def _movement(cause: Cause) -> Movement:
    """Simulate how the true stones of a building move when the ground beneath some settles."""
    building = cause.build({})
    limestone = Material("limestone", density=2350.0, young=12e9, poisson=0.2)
    middle = building.solids[0].vertices[0]
    blocks = tuple(
        Block(
            one.code,
            one.vertices - middle,
            one.faces,
            limestone,
            Fidelity.FIXED if one.code in building.base else Fidelity.RIGID,
        )
        for one in building.solids
    )
    motions = [settlement([code], (0.0, 0.0, z), _DURATION) for code, z in cause.settlement.items()]
    time = TimeSettings(step=0.005, duration=_LONGEST, relaxation=True, start=Start.EQUILIBRIUM)
    result = simulate(Scene("movement", blocks, time=time, loads=Loads(motions=tuple(motions))))
    return {body.code: _motion(body.reference + middle, body.position + middle) for body in result.bodies}


def _motion(before: Array, after: Array) -> RigidMotion:
    """Return the motion between two places (n, 3) of the corners of a rigid stone (Kabsch 1976)."""
    first, second = before.mean(axis=0), after.mean(axis=0)
    left, _, right = np.linalg.svd((after - second).T @ (before - first))
    rotation = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    return RigidMotion(rotation, second - rotation @ first)


def _commands(
    recipe: SampleRecipe, survey: Path, solids: Path | None, knowledge: Path | None, scene: Path
) -> Iterator[str]:
    database = f"--db sqlite:///{survey.with_suffix('.db')}"
    yield f"moma ingest {survey} {database}"
    if solids is not None:
        yield f"moma ingest {solids} --format solids --header {solids.with_name(_HEAD)} {database}"
    if knowledge is not None:
        yield f"moma record {knowledge} {database}"
    if recipe.core:
        yield f"moma propose infill --record {database}"
    yield f"moma run {scene} {database} --out {scene.parent / 'results'}"
    if recipe.cause is not None:
        yield f"moma compare {scene} --battered {database} --out {scene.parent / 'comparison'}"
