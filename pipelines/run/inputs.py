"""Inputs of runs, assessments and loading tests, in words, as their reports state them."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.store.stone_record import StoneRecord
from archmodel.tables.entities import Entity
from archmodel.tables.surveys import Measurement, Survey
from mechanics.scene.scene import Fidelity, Scene
from mechanics.stones.materials import Material
from pipelines.run.assemble import Assembly
from pipelines.run.closing_check import JointsReport, joints_report
from pipelines.run.filling import filling
from pipelines.run.record import settings_of
from pipelines.scene.array_tables import describe
from pipelines.scene.file import SceneFile
from pipelines.scene.selection import Groups, StoneModel
from survey.conventions import LISTED


def scene_inputs(
    scene: SceneFile, assembly: Assembly, groups: Groups, session: Session
) -> dict[str, tuple[str, ...]]:
    """Return what went into a building: lines of text by title, codes under "Supports".

    Parameters
    ----------
    scene, assembly : the scene as its author wrote it and as it was built
    groups : the stones that its tables name
    session : of the database from which the stones came
    """
    built, models = assembly.scene, assembly.models
    materials = Counter(model.material for model in models)
    kinds = Counter(model.record.kind for model in models)
    return {
        "Survey": tuple(_surveys(session, [model.record.code for model in models])),
        "Stones": (f"{len(models)}: " + ", ".join(f"{count} {kind}" for kind, count in kinds.items()),),
        "Depths of the stones": tuple(_depths(models)),
        "Materials": tuple(_material(key, count) for key, count in materials.items()),
        "Contact": tuple(_laws(scene, built, groups)),
        "Supports": tuple(block.code for block in built.blocks if block.fidelity is Fidelity.FIXED),
        "Loads": (
            f"gravity ({', '.join(f'{component:z.4g}' for component in built.gravity)}) m/s²",
            *(describe(entry, groups) for entry in (*scene.loads, *scene.throws)),
        ),
        "Stages": stage_lines(scene, assembly),
        "Joints of the survey": (
            *closing_lines(joints_report(assembly.closing, assembly.origin)),
            filling(scene, assembly).in_words(),
        ),
    }


def run_inputs(
    scene: SceneFile, assembly: Assembly, groups: Groups, session: Session
) -> dict[str, tuple[str, ...]]:
    """Return what went into a run: `scene_inputs`, its steps and its solver."""
    settings = settings_of(scene, assembly.scene)
    return {
        **scene_inputs(scene, assembly, groups, session),
        "Time": (_named(settings["time"]),),
        "Solver": (_named(settings["solver"]),),
    }


def stage_lines(scene: SceneFile, assembly: Assembly) -> tuple[str, ...]:
    """Describe the stages of building: how many stones stand in each and are held, and the loads that act in it."""
    lines = []
    fixed = {block.code for block in assembly.scene.blocks if block.fidelity is Fidelity.FIXED}
    for stage in assembly.stages:
        blocks = stage.scene.blocks
        supports = sum(block.fidelity is Fidelity.FIXED and block.code not in fixed for block in blocks)
        acting = [load.type for load in scene.loads if stage.name in load.values["stages"]]
        facts = [f"{len(blocks)} stones", *([f"{supports} held"] if supports else []), *acting]
        lines.append(f"{stage.name}: {', '.join(facts)}")
    return tuple(lines)


def closing_lines(report: JointsReport) -> tuple[str, ...]:
    """Describe how the joints were closed, and what is left of gaps and overlaps."""
    open_count = sum(report.left_open.values())
    lines = [
        f"{report.mode}: {report.count} closed, {open_count} left open; {1e3 * report.mean_width:z.1f} mm wide on "
        "average as surveyed"
    ]
    if report.worst_stone is not None and report.max_displacement > 0.0:
        lines.append(
            f"corners moved by {1e3 * report.max_displacement:.1f} mm at most (stone {report.worst_stone}), volumes "
            f"changed by {100 * report.max_volume_change:.1f} % at most"
        )
    lines += [line for leaf in report.leaves for line in leaf.in_words()]
    lines += [f"{number} left open: {reason}" for reason, number in report.left_open.items()]
    for name, places in (("gaps", report.gaps), ("overlaps", report.overlaps)):
        if places:
            shown = ", ".join(" and ".join(place.stones) for place in places[:LISTED])
            lines.append(f"{len(places)} {name}: {shown}{', …' if len(places) > LISTED else ''}")
    if report.alone:
        lines.append(f"{len(report.alone)} stones without a joint, e.g. {report.alone[0]}")
    return tuple(lines)


def _surveys(session: Session, codes: Iterable[str]) -> Iterator[str]:
    """Yield the surveys of the stones, with their files and the days on which they were taken in."""
    wanted = set(codes)
    rows = session.execute(select(Entity.code, Survey).join(Entity.measurement).join(Measurement.survey))
    counts = Counter(survey for code, survey in rows if code in wanted)
    for survey, count in counts.most_common(LISTED):
        yield (
            f"{survey.name}: {count} stones; {survey.path}, taken in on {survey.entry.recorded_at:%Y-%m-%d} "
            f"(SHA-256 {survey.sha256[:12]}…)"
        )
    if len(counts) > LISTED:
        yield f"and {len(counts) - LISTED} more"


def _depths(models: Iterable[StoneModel]) -> Iterator[str]:
    """Yield the range of the depths by their source, with the largest standard deviation that is known."""
    sources: dict[str, list[StoneRecord]] = {}
    for model in models:
        sources.setdefault(model.record.depth_source, []).append(model.record)
    for source, records in sorted(sources.items(), key=lambda item: -len(item[1]))[:LISTED]:
        depths = [record.depth for record in records]
        least, most = (f"{value:.3g}" for value in (min(depths), max(depths)))
        span = least if least == most else f"{least} to {most}"
        sigmas = [record.depth_sigma for record in records if record.depth_sigma is not None]
        uncertainty = f"σ up to {1e3 * max(sigmas):.2g} mm" if sigmas else "taken as certain"
        yield f"{source or 'source not stated'}, {len(records)} stones: {span} m, {uncertainty}"
    if len(sources) > LISTED:
        yield f"and {len(sources) - LISTED} more sources"


def _material(material: Material, count: int) -> str:
    strengths = {"tensile": material.tensile_strength, "compressive": material.compressive_strength}
    strength = [
        f"{name} strength {value / 1e6:g} MPa" for name, value in strengths.items() if value is not None
    ]
    return ", ".join(
        [
            f"{material.name}, {count} stones: density {material.density:g} kg/m³",
            f"Young's modulus {material.young / 1e9:g} GPa, Poisson's ratio {material.poisson:g}",
            *strength,
        ]
    )


def _laws(scene: SceneFile, built: Scene, groups: Groups) -> Iterator[str]:
    """Yield the general law with its friction, and those of particular joints."""
    contact = dict(settings_of(scene, built)["contact"])
    law = dict(contact.pop("law"))
    yield f"{law.pop('type')}: {_named(law)}"
    for rule in scene.laws:
        yield describe(rule.entry, groups)
    yield _named(contact)


def _named(values: Mapping[str, object]) -> str:
    stated = {name: value for name, value in values.items() if value is not None}
    return ", ".join(f"{name} {_shown(value)}" for name, value in stated.items())


def _shown(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)
