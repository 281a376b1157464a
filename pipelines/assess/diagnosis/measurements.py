"""Measurements of a diagnosis: the deformation of the stones in the database, by phases if it is to be dated."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from archmodel.database.session import open_database
from archmodel.query.api import find_rows
from archmodel.tables.entries import latest_entry
from pipelines.assess.compare import measured_stones
from pipelines.assess.diagnosis.file import DiagnosisFile
from pipelines.run.assemble import assemble_stones
from pipelines.run.inputs import scene_inputs
from pipelines.scene.file import read_scene
from pipelines.scene.fingerprint import digest
from pipelines.scene.selection import select_groups, select_stones
from survey.quality.deformation import Built, Deformation, measure_deformation
from survey.quality.facades import Facade
from survey.quality.precision import StoneQuality


@dataclass(frozen=True)
class Measurements:
    """The survey as a diagnosis sees it.

    Attributes
    ----------
    stones : measured; if the movement is to be dated, the zone of each names its phase
    facades : of the stones
    deformation : their departure from level and plumb
    phases : of each stone by code; empty if the movement is not to be dated
    resting : codes of stones that rest on those of an earlier phase
    solids : digest of the stones in the database
    inputs : what went into the scene, lines of text by title
    """

    stones: tuple[StoneQuality, ...]
    facades: tuple[Facade, ...]
    deformation: Deformation
    phases: Mapping[str, str]
    resting: frozenset[str]
    solids: str = ""
    inputs: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def measurements(file: DiagnosisFile, url: str) -> Measurements:
    """Return the measurements of the stones of a scene.

    Raises
    ------
    SceneError : the scene has a mistake, or a stone is of none of the phases
    DatabaseError : the database cannot be read
    """
    scene = read_scene(file.scene_path)
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        models = select_stones(scene, session)
        stones, facades = measured_stones(models)
        groups = select_groups(scene, session, models)
        inputs = scene_inputs(scene, assemble_stones(scene, models, groups), groups, session)
        records = [
            [model.record.code, model.record.solid_vertices, model.record.solid_faces] for model in models
        ]
        solids = digest([latest_entry(session), records])
        rows = find_rows(session, "entity", (), columns=("code", "phase")) if file.phases else ()
    phase_of = {str(row["code"]): row["phase"] for row in rows}
    phases = {stone.code: phase_of.get(stone.code) for stone in stones} if file.phases else {}
    for code, phase in phases.items():
        if phase not in file.phases:
            what = (
                f"stone {code} is of {'no phase' if phase is None else f'phase {phase}, which is not listed'}"
            )
            file.document.fail(what, "diagnosis", "phases", remedy="record its phase, or leave 'phases' out")
    measured = measure(file, stones, facades, {code: str(phase) for code, phase in phases.items()})
    return replace(measured, solids=solids, inputs=inputs)


def measure(
    file: DiagnosisFile,
    stones: Sequence[StoneQuality],
    facades: tuple[Facade, ...],
    phases: Mapping[str, str],
) -> Measurements:
    """Return the measurements of given stones, with their phases by code, if any."""
    resting = frozenset(_resting(stones, facades, phases, file.phases)) if phases else frozenset[str]()
    parted = tuple(
        replace(stone, zone=f"{stone.zone or ''} phase {phases[stone.code]}".strip()) if phases else stone
        for stone in stones
    )
    built = Built(file.level_tolerance, file.battered)
    return Measurements(
        parted, facades, measure_deformation(parted, facades, built, resting), phases, resting
    )


def _resting(
    stones: Sequence[StoneQuality],
    facades: Sequence[Facade],
    phases: Mapping[str, str],
    order: Sequence[str],
) -> Iterator[str]:
    """Yield the stones above stones of an earlier phase in the course below: their beds may follow older work."""
    for facade in facades:
        members = [stones[i] for i in facade.members.tolist() if stones[i].course is not None]
        along = {
            stone.code: (stone.outline - facade.frame.origin) @ facade.frame.axes[0] for stone in members
        }
        for stone in members:
            heights = along[stone.code]
            below = (
                member
                for member in members
                if member.course == (stone.course or 0) - 1 and member.zone == stone.zone
            )
            if any(
                order.index(phases[other_stone.code]) < order.index(phases[stone.code])
                and along[other_stone.code].min() < heights.max()
                and heights.min() < along[other_stone.code].max()
                for other_stone in below
            ):
                yield stone.code
