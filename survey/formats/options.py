"""What a reader is told besides the name of the file, and how strict it is."""

from dataclasses import dataclass, replace
from pathlib import Path

from moma.errors import UsageError
from survey.records.survey import BlockRecord, Reject, Survey, SurveyHead, SurveyStream

__all__ = ["ReadingOptions", "whole"]


@dataclass(frozen=True)
class ReadingOptions:
    """What a survey file may leave unsaid.

    Attributes
    ----------
    codes : how the descriptions of point lists, and the names of solids, are made up of the fields
        {block}, {kind}, {course}, {zone} and {role}; None: "{block}:{role}" for point lists, "{block}:{kind}"
        for solids
    kind : of stones that do not say it
    sigma : standard deviation of a coordinate, where the file does not say it [m]
    head : from a header file, for formats that have no head of their own
    unit : length of the unit in which solids are given [m]
    flat : polygons of solids whose corners lie so near to a plane are taken for plane [m], and those as near as `snap`
    snap : faces of neighbouring solids that match but for so much are brought into one plane [m]; 0: none is
    """

    codes: str | None = None
    kind: str = "ashlar"
    sigma: float = 0.003
    head: SurveyHead | None = None
    unit: float = 1.0
    flat: float = 0.0
    snap: float = 0.0

    def head_for(self, path: Path) -> SurveyHead:
        """Make the head of a file that has none of its own: that of the header file, under the file's own path."""
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
    for one in stream.blocks:
        if isinstance(one, Reject):
            raise one.error
        if not isinstance(one, BlockRecord):
            raise UsageError(
                "the file holds solids, not measured faces", where=str(path), remedy="go through its stream"
            )
        blocks.append(one)
    return Survey(stream.head, tuple(blocks))
