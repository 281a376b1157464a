"""How deep a stone is: the evidence, in its order."""

from collections.abc import Sequence
from dataclasses import dataclass

from moma.errors import SurveyError
from survey.records import BlockRecord, DepthRule

__all__ = ["Depth", "depth_for"]


@dataclass(frozen=True)
class Depth:
    """The depth of one stone behind its face.

    Attributes
    ----------
    value : [m]
    sigma : standard deviation [m]; None if not known
    source : the evidence, in words
    origin : "stone" if measured on this stone, "kind" if from the rule of its kind
    line : line of the survey file that says so
    """

    value: float
    sigma: float | None
    source: str
    origin: str
    line: int


def depth_for(record: BlockRecord, rules: Sequence[DepthRule]) -> Depth:
    """Find the depth of a stone: measured on the stone itself, else the rule of its kind.

    Parameters
    ----------
    record : one stone of a survey
    rules : the depth rules of the survey

    Raises
    ------
    SurveyError
        if nothing is known of the stone's depth
    """
    if record.depth is not None:
        source = record.depth_source or "measured on the stone"
        return Depth(record.depth, record.depth_sigma, source, "stone", record.line)
    for rule in rules:
        if rule.kind == record.kind:
            return Depth(rule.depth, rule.sigma, rule.source, "kind", rule.line)
    raise SurveyError(
        f"no depth is known for a {record.kind}",
        where=f"stone {record.code} (line {record.line})",
        remedy=f"measure the stone, or put 'depth {record.kind} D source TEXT' before the stones",
    )
