"""The scene of a run as scripts for other programs need it: blocks in the frame of the site, and laws by pair."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.tables.runs import Run
from ground.errors import UsageError
from mechanics.arrays import Array
from mechanics.scene.laws.law import Law
from mechanics.scene.scene import Block, Fidelity, Scene
from pipelines.run.assemble import assemble
from pipelines.scene.file import parse_scene


@dataclass(frozen=True)
class Part:
    """A convex body, and the stone that it is of.

    Attributes
    ----------
    block : the stone
    vertices, faces : of the body, in the frame of the site [m]
    """

    block: Block
    vertices: Array
    faces: Sequence[Sequence[int]]


@dataclass(frozen=True)
class SameScene:
    """A scene, its bodies, and the number of its run."""

    scene: Scene
    parts: tuple[Part, ...]
    run: int


def same_scene(session: Session, run: int | None, program: str) -> SameScene:
    """Assemble the scene of a run anew, from the stones as they are held now.

    Raises
    ------
    UsageError : no run is named, or its scene is of another kind
    """
    if run is None:
        remedy = "name a run with --run: its scene has the laws, the supports and the closed joints"
        raise UsageError(f"a script for {program} needs a scene", where="export", remedy=remedy)
    text = session.scalar(select(Run.scene_text).where(Run.id == run))
    assembly = assemble(parse_scene(text or "", f"scene of run {run}"), session)
    parts = []
    for block in assembly.scene.blocks:
        if block.radius is not None:
            raise UsageError(
                f"block {block.code} is a ball", where=f"run {run}", remedy="name a run of polyhedra"
            )
        bodies = [(part.vertices, part.faces) for part in block.parts] or [(block.vertices, block.faces)]
        parts += [Part(block, np.asarray(vertices) + assembly.origin, faces) for vertices, faces in bodies]
    return SameScene(assembly.scene, tuple(parts), run)


def law_of(scene: Scene, first: str, second: str) -> Law:
    """Return the law between two blocks, by their codes; of two rules for the same pair, the later holds."""
    law = scene.contact.law
    for rule in scene.contact.rules:
        if (first in rule.first and second in rule.second) or (second in rule.first and first in rule.second):
            law = rule.law
    return law


def is_fixed(block: Block) -> bool:
    """Return whether a stone never moves."""
    return block.fidelity is Fidelity.FIXED


@dataclass(frozen=True)
class LawGroups:
    """Blocks that no law tells apart, and the laws between these groups.

    Attributes
    ----------
    of : by code the group of each block
    laws : each law with the pairs of groups between which it holds
    """

    of: dict[str, int]
    laws: list[tuple[Law, list[tuple[int, int]]]]


def laws_by_group(scene: Scene, blocks: Sequence[Block]) -> LawGroups:
    """Group blocks by the rules that name them, and list the laws between all groups."""
    rules = scene.contact.rules
    signs: dict[tuple[tuple[bool, bool], ...], int] = {}
    of: dict[str, int] = {}
    examples: list[str] = []
    for block in blocks:
        sign = tuple((block.code in rule.first, block.code in rule.second) for rule in rules)
        if sign not in signs:
            signs[sign] = len(signs)
            examples.append(block.code)
        of[block.code] = signs[sign]
    laws: list[tuple[Law, list[tuple[int, int]]]] = []
    for first in range(len(examples)):
        for second in range(first, len(examples)):
            law = law_of(scene, examples[first], examples[second])
            for law_known, pairs in laws:
                if law_known == law:
                    pairs.append((first, second))
                    break
            else:
                laws.append((law, [(first, second)]))
    return LawGroups(of, laws)
