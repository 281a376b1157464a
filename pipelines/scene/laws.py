"""Laws of particular joints: from [[laws]] of a scene file to rules between groups of stones."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from ground.settings import Setting
from ground.toml.keys import Groups, Texts, build, keys_of
from ground.toml.schema import Key, TomlDocument, nearest
from mechanics.scene.laws.cohesive_zone import CohesiveZone
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.laws.law import Law
from mechanics.scene.laws.lennard_jones import LennardJones
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.scene import LawRule
from pipelines.scene.array_tables import ArrayTable, read_entries

BONDS = ("mortar", "cohesive_zone", "elastic_joint")
"""Types of laws that are mortar."""

_CLASSES: Mapping[str, type[Law]] = {
    "dry": DryJoint,
    "mortar": MortarJoint,
    "cohesive_zone": CohesiveZone,
    "elastic_joint": ElasticJoint,
    "lennard_jones": LennardJones,
}

LAW_TYPES: Mapping[str, tuple[Key, ...]] = {
    # the default of friction is that of [contact] alone
    name: keys_of(law, "friction")
    for name, law in _CLASSES.items()
}


@dataclass(frozen=True, kw_only=True)
class _Between:
    """Stones between which a law holds."""

    materials: Annotated[Texts, Setting("Two names of materials: the law holds between their stones.")] = ()
    between: Annotated[
        Groups,
        Setting(
            "Two lists of codes or expressions: the law holds between the stones of the one and those of the "
            "other."
        ),
    ] = ()


LAW_KEYS = keys_of(_Between)
"""Keys of every law."""


@dataclass(frozen=True)
class JointLaw:
    """A law and its table, which names two materials, two groups of stones, or neither."""

    entry: ArrayTable
    law: Law


def read_laws(document: TomlDocument, toml: Mapping[str, Any]) -> tuple[JointLaw, ...]:
    """Check and build all laws; the stones between which they hold are still expressions."""
    materials = tuple(toml.get("materials", {}))
    return tuple(
        _law(document, entry, materials)
        for entry in read_entries(document, toml, "laws", LAW_TYPES, LAW_KEYS)
    )


def _law(document: TomlDocument, entry: ArrayTable, materials: Sequence[str]) -> JointLaw:
    named = entry.values["materials"]
    if named and entry.values["between"]:
        remedy = "give one of them, or neither for all joints"
        document.fail("both 'materials' and 'between'", *entry.path, "between", remedy=remedy)
    if named and len(named) != 2:
        remedy = "give two names; twice the same for the joints within one material"
        document.fail(f"{len(named)} materials", *entry.path, "materials", remedy=remedy)
    for name in named:
        if name not in materials:
            what = f"unknown material {name!r}"
            document.fail(what, *entry.path, "materials", remedy=nearest(name, materials))
    with document.at(*entry.path):
        return JointLaw(entry, build(_CLASSES[entry.type], entry.values))


def law_rules(
    document: TomlDocument,
    laws: Iterable[JointLaw],
    groups: Mapping[tuple[str, ...], Sequence[frozenset[str]]],
    materials: Mapping[str, str],
    beds: Mapping[frozenset[str], float],
) -> tuple[LawRule, ...]:
    """Return the rules between groups of codes.

    Parameters
    ----------
    groups : the stones that the tables of the laws name
    materials : by code the material of each stone
    beds : thickness of the mortar between stones; where they touch elsewhere, at a corner, it is the mean of these [m]
    """
    mean = float(np.mean(list(beds.values()))) if beds else None
    rules = []
    for one in laws:
        path, named = one.entry.path, one.entry.values["materials"]
        sides = list(groups[path])
        for name in named:
            side = frozenset(code for code, material in materials.items() if material == name)
            if not side:
                what = f"no selected stone is of {name!r}"
                document.fail(what, *path, "materials", remedy="leave the law out, or select its stones")
            sides.append(side)
        first, second = sides or [frozenset(materials)] * 2
        law = one.law
        if isinstance(law, ElasticJoint) and law.by_thickness and law.thickness is None:
            law = replace(law, thickness=mean)
        rules.append(LawRule(first, second, law))
    return tuple(rules)
