"""Options of the readers, and the reading of a whole file at once."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from ground.errors import UsageError
from survey.records.survey import BlockRecord, Reject, Survey, SurveyHead, SurveyStream

SIGMA = 0.003
"""Standard deviation of a measured point, where nothing states it [m]."""


@dataclass(frozen=True)
class ReadingOptions:
    """Values that a survey file may leave out.

    Attributes
    ----------
    codes : template of the descriptions of point lists and of the names of solids, with the fields
        {block}, {kind}, {course}, {zone} and {role}; None: "{block}:{role}" for point lists, "{block}:{kind}"
        for solids
    kind : of stones without a kind in the file
    sigma : standard deviation of a coordinate, where the file states none [m]
    head : from a header file, for formats that have no head of their own
    unit : length of the unit in which coordinates are given, where columns state none [m]; None: metres, unless asked
    columns : names of columns by what they are, e.g. ``block=Stein,x=Rechts``; None: known names
    sheet : of a workbook; None: the only one
    kinds : kinds of stones by their abbreviation in lower case
    roles : roles of points by words that are the user's own, in lower case
    known_kinds : all kinds that there are; empty: any
    flat : distance from a plane within which the corners of a polygon of a solid count as plane [m]; at least `snap`
    snap : tolerance within which matching faces of neighbouring solids are brought into one plane [m]; 0: none is
    planes : distance of the facets of a scanned solid from a plane within which they are one face [m]; 0: every
        facet is kept
    up : axis that points upwards in files of solids, "y" or "z"; None: z, unless asked
    repair : distance within which faults of solids are repaired [m]; None: 10⁻⁵ of their size; 0: none is
    files : files of solids that are one survey together; none: only the given one
    """

    codes: str | None = None
    kind: str = "ashlar"
    sigma: float = SIGMA
    head: SurveyHead | None = None
    unit: float | None = None
    columns: str | None = None
    sheet: str | None = None
    kinds: Mapping[str, str] = field(default_factory=dict)
    known_kinds: frozenset[str] = frozenset()
    roles: Mapping[str, str] = field(default_factory=dict)
    flat: float = 0.0
    snap: float = 0.0
    planes: float = 0.005
    up: str | None = None
    repair: float | None = None
    files: tuple[Path, ...] = ()

    @property
    def scale(self) -> float:
        """Length of the unit of coordinates [m]."""
        return 1.0 if self.unit is None else self.unit

    def head_for(self, path: Path) -> SurveyHead:
        """Make the head of a file without one of its own: that of the header file, under the file's own path."""
        head = self.head or SurveyHead("", "")
        return replace(head, name=head.name or path.stem, path=str(path))


def whole(stream: SurveyStream, path: Path) -> Survey:
    """Read a survey to its end, and refuse it if any of its stones is wrong.

    Raises
    ------
    SurveyError
        of the first stone that is wrong
    UsageError
        if the file holds solids
    """
    blocks: list[BlockRecord] = []
    for block in stream.blocks:
        if isinstance(block, Reject):
            raise block.error
        if not isinstance(block, BlockRecord):
            raise UsageError(
                "the file holds solids, not measured faces", where=str(path), remedy="iterate over its stream"
            )
        blocks.append(block)
    return Survey(stream.head, tuple(blocks))
