"""Classification of contacts as relations: rests on, beside, behind, bonded with.

Plain values in and out: which pairs touch where and in which direction (as a search of their solids finds it), what
kinds the stones are and which way their faces look. The definitions are in ``docs/relations.md``.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from archmodel.arrays import Array, Bools, Ints
from archmodel.tables.entities import Entity, Header, Quoin, RibSegment, Voussoir, WebStone
from archmodel.tables.hierarchy import names_below
from archmodel.tables.relations import RELATIONS
from ground.errors import UsageError

_RESTS_ON, _BESIDE, _BONDED, _ACROSS = (
    RELATIONS.index(name) for name in ("rests_on", "beside", "bonded_with", "across_the_wall")
)


@dataclass(frozen=True)
class RelationSettings:
    """Tolerances of contact and of its classification; kept in the entry of the relations found with them.

    Attributes
    ----------
    width : widest open joint [m]
    angle : largest angle between the two faces of a joint [degrees]
    overlap : largest depth by which stones may lie in each other [m]
    share : least part of the smaller face that the other covers [-]
    bed : a joint whose normal is nearer to the vertical than this is a bed [degrees]
    arch : least slope at which a stone of an arch rests on the next [degrees]
    skewback : least slope at which a stone of an arch rests on one that is none [degrees]
    web : least slope at which a stone of a web rests on the next, or on a rib [degrees]
    along : two directions nearer to each other than this are one [degrees]
    """

    width: float = 0.04
    angle: float = 12.0
    overlap: float = 0.02
    share: float = 0.03
    bed: float = 45.0
    arch: float = 1.0
    skewback: float = 20.0
    web: float = 5.0
    along: float = 45.0

    def __post_init__(self) -> None:
        limits = {"width": 1.0, "overlap": 1.0, "share": 1.0}
        for name, value in asdict(self).items():
            largest = limits.get(name, 90.0)
            if not 0.0 <= value <= largest:
                raise UsageError(f"{name} is {value:g}", remedy=f"give it between 0 and {largest:g}")


@dataclass(frozen=True)
class StonesOf:
    """Attributes of stones that classification needs.

    Attributes
    ----------
    kinds : (n,) names of their kinds
    normals : (n, 3) outward unit normals of their faces; NaN where there is none [-]
    """

    kinds: Sequence[str]
    normals: Array


@dataclass(frozen=True)
class StoneContacts:
    """Contacts between stones.

    Attributes
    ----------
    pairs : (m, 2) indices of the stones
    area : (m,) that they share [m²]
    gap : (m,) width of the joint between them [m]
    normal : (m, 3) unit normal, from the second to the first [-]
    centroid : (m, 3) [m]
    """

    pairs: Ints
    area: Array
    gap: Array
    normal: Array
    centroid: Array


@dataclass(frozen=True)
class FoundRelations:
    """Relations in the order of kind, subject and object, one of a kind for each pair.

    Attributes
    ----------
    kind : (m,) index into `RELATIONS`
    subject, object : (m,) indices of the stones; the smaller one first where the relation holds both ways
    area, gap, centroid : (m,), (m,), (m, 3) of the joint [m²], [m], [m]
    normal : (m, 3) from object to subject [-]
    """

    kind: Ints
    subject: Ints
    object: Ints
    area: Array
    gap: Array
    centroid: Array
    normal: Array

    def __len__(self) -> int:
        return len(self.kind)


def relations_between(
    contacts: StoneContacts, stones: StonesOf, settings: RelationSettings | None = None
) -> FoundRelations:
    """Classify the contacts of stones.

    Parameters
    ----------
    contacts : where they touch; a pair may come more than once, with different normals
    stones : all that the contacts name
    settings : tolerances; None: RelationSettings()
    """
    settings = settings or RelationSettings()
    first, second = contacts.pairs[:, 0], contacts.pairs[:, 1]
    faces = _Faces.of(contacts, stones, settings)
    rests = _rests(contacts, stones, settings) & ~faces.across
    upward = contacts.normal[:, 2] > 0.0
    upper, lower = np.where(upward, first, second), np.where(upward, second, first)
    rests &= ~_contradicted(upper, lower, contacts, rests, len(stones.kinds), settings)
    bonded = faces.bonded(stones.kinds, first, second, rests)
    beside = ~rests & ~faces.across & ~(bonded & faces.opposite)
    turned = np.where(upward, 1.0, -1.0)
    low, high = np.minimum(first, second), np.maximum(first, second)
    ordered = np.where(first < second, 1.0, -1.0)
    parts = [(_RESTS_ON, rests, upper, lower, turned)]
    parts += [
        (kind, mask, low, high, ordered)
        for kind, mask in ((_BESIDE, beside), (_BONDED, bonded), (_ACROSS, faces.across))
    ]
    return _merged(contacts, parts)


@dataclass(frozen=True)
class _Faces:
    """Directions of the two faces of each contact.

    Attributes
    ----------
    across : (m,) back to back: both look away from the joint, along its normal
    opposite : (m,) they look opposite ways, and so belong to two facings
    apart : (m,) they look different ways, opposite ones or not
    back : (m,) the joint is parallel to the faces
    """

    across: Bools
    opposite: Bools
    apart: Bools
    back: Bools

    @classmethod
    def of(cls, contacts: StoneContacts, stones: StonesOf, settings: RelationSettings) -> "_Faces":
        """Return the directions of the faces of each contact."""
        near_cosine = np.cos(np.radians(settings.along))
        first_normal, two = stones.normals[contacts.pairs[:, 0]], stones.normals[contacts.pairs[:, 1]]
        steepest = np.sin(np.radians(settings.bed))
        upright = (np.abs(first_normal[:, 2]) <= steepest) & (np.abs(two[:, 2]) <= steepest)
        cosine = (first_normal * two).sum(axis=1)
        along_one = (first_normal * contacts.normal).sum(axis=1)
        along_two = (two * contacts.normal).sum(axis=1)
        opposite = upright & (cosine <= -near_cosine)
        return cls(
            across=opposite & (along_one >= near_cosine) & (along_two <= -near_cosine),
            opposite=opposite,
            apart=upright & (cosine < near_cosine),
            back=(np.abs(along_one) >= near_cosine) & (np.abs(along_two) >= near_cosine),
        )

    def bonded(self, names: Sequence[str], first: Ints, second: Ints, rests: Bools) -> Bools:
        """Contacts that tie two facings, or two walls, together."""
        header, quoin = (_is_one_of(names, cls) for cls in (Header, Quoin))
        tied = self.opposite & (~self.back | header[first] | header[second])
        corner = (quoin[first] | quoin[second]) & (self.apart | ~rests)
        return np.asarray(tied | (corner & ~self.across))


def _is_one_of(names: Sequence[str], *classes: type[Entity]) -> Bools:
    """Return a mask of the stones that are of a kind or its subkinds."""
    wanted = names_below(*classes)
    return np.fromiter((name in wanted for name in names), dtype=np.bool_, count=len(names))


def _rests(contacts: StoneContacts, stones: StonesOf, settings: RelationSettings) -> Bools:
    """Return the contacts by which one stone rests on the other."""
    first, second = contacts.pairs[:, 0], contacts.pairs[:, 1]
    arch = _is_one_of(stones.kinds, Voussoir, RibSegment)
    rise = contacts.normal[:, 2]
    bed = np.abs(rise) >= np.cos(np.radians(settings.bed))
    web = _is_one_of(stones.kinds, WebStone)
    shell = (arch | web)[first] & (arch | web)[second] & (web[first] | web[second])
    least = np.sin(np.radians(np.where(shell, settings.web, settings.arch)))
    within = (shell | (arch[first] & arch[second])) & (np.abs(rise) >= least)
    upper = np.where(rise > 0.0, arch[first], arch[second])
    lower = np.where(rise > 0.0, arch[second], arch[first])
    foot = upper & ~lower & (np.abs(rise) >= np.sin(np.radians(settings.skewback)))
    return np.asarray(bed | within | foot)


def _contradicted(
    upper: Ints,
    lower: Ints,
    contacts: StoneContacts,
    rests: Bools,
    count: int,
    settings: RelationSettings,
) -> Bools:
    """Return the contacts that would let a stone rest on itself through others: the least steep of each circle.

    Beds are not given up: stones that truly lie on one another in a ring stay so.
    """
    given_up = np.zeros(len(rests), np.bool_)
    rise = np.abs(contacts.normal[:, 2])
    flattest = np.cos(np.radians(settings.bed))
    while True:
        left = np.flatnonzero(rests & ~given_up)
        graph = coo_array((np.ones(len(left)), (upper[left], lower[left])), shape=(count, count))
        _, member = connected_components(graph, directed=True, connection="strong")
        inside = left[member[upper[left]] == member[lower[left]]]
        inside = inside[rise[inside] < flattest]
        if len(inside) == 0:
            return given_up
        order = np.lexsort((rise[inside], member[upper[inside]]))
        first = np.unique(member[upper[inside]][order], return_index=True)[1]
        given_up[inside[order[first]]] = True


def _merged(contacts: StoneContacts, parts: Sequence[tuple[int, Bools, Ints, Ints, Array]]) -> FoundRelations:
    """Merge relations to one of a kind for each pair, with the area of all its contacts."""
    rows = np.concatenate([np.flatnonzero(mask) for _, mask, _, _, _ in parts])
    kind = np.concatenate([np.full(int(mask.sum()), number) for number, mask, _, _, _ in parts])
    subject = np.concatenate([first[mask] for _, mask, first, _, _ in parts])
    target = np.concatenate([two[mask] for _, mask, _, two, _ in parts])
    sign = np.concatenate([turn[mask] for _, mask, _, _, turn in parts])
    order = np.lexsort((target, subject, kind))
    rows, kind, subject, target, sign = (column[order] for column in (rows, kind, subject, target, sign))
    new = np.ones(len(rows), np.bool_)
    new[1:] = (np.diff(kind) != 0) | (np.diff(subject) != 0) | (np.diff(target) != 0)
    starts = np.flatnonzero(new)
    if len(starts) == 0:
        none, empty = np.zeros(0, np.int64), np.zeros(0)
        return FoundRelations(none, none, none, empty, empty, np.zeros((0, 3)), np.zeros((0, 3)))
    weight = contacts.area[rows]
    area = np.add.reduceat(weight, starts)
    normal = np.add.reduceat((weight * sign)[:, None] * contacts.normal[rows], starts)
    # about a place of each joint: nothing is lost 10⁶ m from the origin
    origin = contacts.centroid[rows[starts]]
    offset = contacts.centroid[rows] - np.repeat(origin, np.diff([*starts, len(rows)]), axis=0)
    return FoundRelations(
        kind=kind[starts],
        subject=subject[starts],
        object=target[starts],
        area=area,
        gap=np.add.reduceat(weight * contacts.gap[rows], starts) / area,
        centroid=origin + np.add.reduceat(weight[:, None] * offset, starts) / area[:, None],
        normal=normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None],
    )
