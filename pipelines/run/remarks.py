"""Remarks for the author of a scene: keys and laws without effect, and limits of its stresses."""

from collections.abc import Iterator, Mapping, Sequence

from mechanics.scene.laws.mortar import held_tension
from mechanics.scene.scene import Fidelity, LawRule
from pipelines.run.fidelity import Modelled
from pipelines.scene.file import SceneFile
from pipelines.scene.selection import STRESS, Groups
from survey.geometry.solids import volume_of
from survey.joints.report import ClosingReport
from survey.joints.settings import JointMode
from survey.simplify.simplify import BlockyStone

_MEASURED = ("points", "photograph")  # sources of faces that were measured, not imported with a solid
_STRESS = 'ask for their stress by stress in [output], or give default = "deformable" in [bodies]'


def remarks(scene: SceneFile, groups: Groups, modelled: Mapping[str, Modelled]) -> tuple[str, ...]:
    """Return the keys without effect, with place and remedy, and a caution where stresses are beside rigid stones.

    Parameters
    ----------
    scene : as its author wrote it
    groups : which stones its tables name
    modelled : by code, the model of each stone
    """
    soft = {code for code, model in modelled.items() if model.fidelity is Fidelity.DEFORMABLE}
    return (
        *_of_meshes(scene, groups, soft),
        *_of_stress(scene, groups, modelled),
        *_of_ring(scene, modelled),
        *_of_surroundings(scene, modelled),
    )


def remarks_on_laws(scene: SceneFile, rules: Sequence[LawRule], closing: ClosingReport) -> tuple[str, ...]:
    """Return the laws that hold in no joint, and those that hold less tension than they state, with their places.

    Parameters
    ----------
    scene : as its author wrote it
    rules : its laws, in their order, between groups of stones
    closing : the joints; none are known where stones stay as surveyed
    """
    where, without_effect = scene.document.where, list[str]()
    for rule_law in scene.laws:
        values = rule_law.entry.values
        if not values.get("tension") or not rule_law.law.friction:
            continue
        carried = held_tension(rule_law.law.friction, values["tension"], values["shear"])
        if carried < values["tension"]:
            enough = rule_law.law.friction * values["tension"]
            without_effect.append(
                f"{where(*rule_law.entry.path, 'tension')}: of tension = {values['tension']:g} Pa no more than "
                f"shear/friction = {carried:.4g} Pa is held; a shear of {enough:.4g} Pa would hold all of it"
            )
    if closing.mode is JointMode.AS_SURVEYED:
        return tuple(without_effect)
    holding = [0] * len(rules)
    joints = [0] * len(rules)
    for joint in closing.joints:
        meant = [n for n, rule in enumerate(rules) if _lies_between(rule, *joint.stones)]
        for number in meant:
            joints[number] += 1
        if meant:
            holding[meant[-1]] += 1
    for law, met, carried in zip(scene.laws, joints, holding, strict=True):
        if not carried:
            reason = "later laws hold in all of them" if met else "it holds only where they come to meet"
            joined = f"{met} joints lie between its stones" if met else "no joint lies between its stones"
            without_effect.append(f"{where(*law.entry.path)}: [[laws]] has no effect: {joined}; {reason}")
    return tuple(without_effect)


def _lies_between(rule: LawRule, first: str, second: str) -> bool:
    return (first in rule.first and second in rule.second) or (second in rule.first and first in rule.second)


def remarks_on_stones(stones: Sequence[BlockyStone]) -> tuple[str, ...]:
    """Return a remark on the imported stones whose warped faces were made plane: by how much, and what it weighs."""
    changed = [
        stone for stone in stones if stone.face.provenance.source not in _MEASURED and not stone.report.within
    ]
    if not changed:
        return ()
    moved = max(changed, key=lambda stone: float(stone.report.displacement.max()))
    grown = max(changed, key=lambda stone: abs(stone.report.volume_change))
    after = [volume_of(stone.solid) for stone in changed]
    before = [new / (1.0 + stone.report.volume_change) for new, stone in zip(after, changed, strict=True)]
    return (
        f"the warped faces of {len(changed)} stone{'' if len(changed) == 1 else 's'} were made plane: corners moved by "
        f"up to {1e3 * moved.report.displacement.max():.2g} mm (stone {moved.code}), volumes changed by up to "
        f"{100 * grown.report.volume_change:+.2g} % (stone {grown.code}), by {1e3 * (sum(after) - sum(before)):+.2g} "
        f"dm³ or {100 * (sum(after) / sum(before) - 1):+.2g} % together; moma check -v lists them",
    )


def _of_meshes(scene: SceneFile, groups: Groups, soft: set[str]) -> Iterator[str]:
    lines, where = scene.document.lines, scene.document.where
    if ("mesh",) in lines and not soft:
        yield f"{where('mesh')}: [mesh] has no effect: no stone deforms; {_STRESS}"
    for entry in scene.meshes:
        if not groups[entry.path][0] & soft:
            yield f"{where(*entry.path)}: [[meshes]] has no effect: none of its stones deforms; {_STRESS}"


def _of_ring(scene: SceneFile, modelled: Mapping[str, Modelled]) -> Iterator[str]:
    region = scene.output.stress is not None and any(stone.stress for stone in modelled.values())
    ringed = any(stone.ring for stone in modelled.values())
    for table, key, used, reason in (
        ("bodies", "ring", region, "no stress in [output] asks for that of a stone"),
        ("mesh", "ring_size", ringed, "no stone deforms for the stress of another"),
    ):
        if (table, key) not in scene.document.lines:
            continue
        if scene.bodies.default is not None:
            reason = 'it goes with default = "auto" and stress in [output]'
        elif used:
            continue
        yield f"{scene.document.where(table, key)}: {key} has no effect: {reason}"


def _of_stress(scene: SceneFile, groups: Groups, modelled: Mapping[str, Modelled]) -> Iterator[str]:
    where, asked = scene.document.where, groups[STRESS][0]
    without = sorted(code for code in asked if modelled[code].fidelity is not Fidelity.DEFORMABLE)
    if asked and len(without) == len(asked):
        reason = modelled[without[0]].reason
        yield f"{where(*STRESS)}: stress has no effect: none of its stones deforms ({without[0]}: {reason})"
    else:
        rigid = [code for code in without if modelled[code].fidelity is Fidelity.RIGID]
        if rigid:
            reason = modelled[rigid[0]].reason
            yield f"{where(*STRESS)}: {len(rigid)} of the stones of stress have none: {rigid[0]} is rigid ({reason})"


def _of_surroundings(scene: SceneFile, modelled: Mapping[str, Modelled]) -> Iterator[str]:
    rigid = sum(stone.fidelity is Fidelity.RIGID for stone in modelled.values())
    if scene.bodies.default is None and rigid and any(stone.stress for stone in modelled.values()):
        yield (
            f"{scene.document.where('bodies')}: {rigid} stones are rigid and spread forces otherwise than elastic "
            "ones, so stresses may be off by tens of per cent; ring = 99 in [bodies] lets all of them deform, "
            "coarsely (docs/accuracy.md, section 13)"
        )
