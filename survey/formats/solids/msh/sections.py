"""Sections of a Gmsh MSH file, 2.2 and 4.1, text and binary, that describe its volumes.

Every count is checked against the size of the file before memory is allocated, and every node of an element must exist:
general mesh readers trust the file, and return uninitialised memory where it is wrong.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ground.tables.numbers import shown, unreadable
from survey.arrays import Array, Ints, no_places
from survey.formats.solids.msh.numbers import MshNumbers

_COUNTS = "2 3 4 4 8 6 5 3 6 9 10 27 18 14 1 8 20 15 13 9 10 12 15 15 21 4 5 6 20 35"
_NODES = dict(enumerate(map(int, _COUNTS.split()), start=1))  # number of nodes of each type of element
_NAME = re.compile(r'\s*(\d+)\s+(-?\d+)\s+"(.*)"\s*', re.ASCII)


@dataclass(frozen=True)
class Elements:
    """Elements of one type.

    Attributes
    ----------
    type : Gmsh's number of the type
    nodes : (n, k) rows of `MshFile.points`
    entity : (n,) number of the entity
    physical : (n,) number of the physical group, 0 if it is in none
    """

    type: int
    nodes: Ints
    entity: Ints
    physical: Ints


@dataclass
class MshFile:
    """The volumes of a file.

    Attributes
    ----------
    points : (n, 3) [m]
    elements : of all types, lines and triangles too
    names : of the physical volumes, by number
    """

    path: Path
    points: Array = field(default_factory=no_places)
    elements: list[Elements] = field(default_factory=list)
    names: dict[int, str] = field(default_factory=dict)
    _tags: Ints = field(default_factory=lambda: np.empty(0, dtype=np.int64))  # of the points, ascending
    _order: Ints = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    _physical: dict[tuple[int, int], int] = field(
        default_factory=dict
    )  # by dimension and number of the entity

    def __post_init__(self) -> None:
        """Read the file."""
        try:
            data = self.path.read_bytes()
        except OSError as error:
            raise unreadable(self.path, error) from error
        self._numbers = MshNumbers(data, str(self.path))
        while (name := self._numbers.section()) is not None:
            match name, self._numbers.version:
                case "PhysicalNames", _:
                    self._read_names(self._numbers.text(name))
                case "Entities", "4.1":
                    self._read_entities()
                case "Nodes", version:
                    self._read_nodes_4() if version == "4.1" else self._read_nodes_2()
                case "Elements", version:
                    self._read_elements_4() if version == "4.1" else self._read_elements_2()
                case _:
                    self._numbers.text(name)
                    continue
            self._numbers.end(name)

    def _read_names(self, lines: list[str]) -> None:
        for line in lines[1:]:
            match = _NAME.fullmatch(line)
            if match is None:
                raise self._numbers.fail(f"{shown(line)} is not a physical name")
            if match[1] == "3":
                self.names[int(match[2])] = match[3]

    def _read_entities(self) -> None:
        numbers = self._numbers
        for dimension, count in enumerate(numbers.sizes(4).tolist()):
            for _ in range(numbers.plausible(count)):
                (tag,) = numbers.integers(1).tolist()
                numbers.reals(3 if dimension == 0 else 6)
                groups = numbers.integers(numbers.size())
                if len(groups):
                    self._physical[dimension, tag] = abs(int(groups[0]))
                if dimension:
                    numbers.integers(numbers.size())

    def _read_nodes_4(self) -> None:
        numbers = self._numbers
        blocks, total, _, _ = numbers.sizes(4).tolist()
        tags, points = [], []
        for _ in range(numbers.plausible(blocks)):
            _, _, parametric = numbers.integers(3).tolist()
            if parametric:
                raise numbers.fail("nodes with parametric coordinates", "save the mesh without them")
            count = numbers.size()
            tags.append(numbers.sizes(count))
            points.append(numbers.reals(3 * count).reshape(-1, 3))
        self._set_nodes(
            np.concatenate([np.empty(0, dtype=np.int64), *tags]), np.vstack([self.points, *points]), total
        )

    def _read_nodes_2(self) -> None:
        numbers = self._numbers
        (total,) = numbers.counts(1).tolist()
        tags, points = numbers.records(total)
        self._set_nodes(tags, points, total)

    def _set_nodes(self, tags: Ints, points: Array, total: int) -> None:
        self._order = np.argsort(tags, kind="stable")
        self._tags = tags[self._order]
        if len(tags) != total or (np.diff(self._tags) == 0).any() or len(self.points):
            raise self._numbers.fail(f"{len(np.unique(tags))} nodes for {total}")
        self.points = points

    def _read_elements_4(self) -> None:
        numbers = self._numbers
        blocks, total, _, _ = numbers.sizes(4).tolist()
        for _ in range(numbers.plausible(blocks)):
            dimension, entity, kind = numbers.integers(3).tolist()
            count = numbers.size()
            width = 1 + self._node_count(kind)
            rows = numbers.sizes(count * width).reshape(count, width)
            group = self._physical.get((dimension, entity), 0)
            self._add(kind, rows[:, 1:], np.full(count, entity), np.full(count, group))
        if sum(len(element.nodes) for element in self.elements) != total:
            raise numbers.fail(f"other than the {total} elements that it states")

    def _read_elements_2(self) -> None:
        numbers = self._numbers
        (total,) = numbers.counts(1).tolist()
        read, rows = 0, dict[tuple[int, int], list[Ints]]()
        while read < total:
            kind, count, tags = numbers.element_head()
            width = (1 if numbers.binary else 0) + tags + self._node_count(kind)
            if tags < 2 or not 0 < count <= total - read:
                raise numbers.fail("elements without the number of their entity, or more than it states")
            block = numbers.integers(count * width).reshape(count, width)
            rows.setdefault((kind, tags), []).append(block[:, 1:] if numbers.binary else block)
            read += count
        for (kind, tags), blocks in rows.items():
            joined = np.vstack(blocks)
            self._add(kind, joined[:, tags:], joined[:, 1], joined[:, 0])

    def _node_count(self, kind: int) -> int:
        if kind not in _NODES:
            raise self._numbers.fail(
                f"elements of type {kind}", "mesh with elements of first or second order"
            )
        return _NODES[kind]

    def _add(self, kind: int, tags: Ints, entity: Ints, physical: Ints) -> None:
        places = np.searchsorted(self._tags, tags)
        places = np.minimum(places, len(self._tags) - 1)
        if tags.size and not (len(self._tags) and (self._tags[places] == tags).all()):
            raise self._numbers.fail("an element refers to a node that does not exist")
        nodes = self._order[places] if tags.size else tags
        self.elements.append(Elements(kind, nodes, entity, physical))
