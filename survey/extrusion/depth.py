"""Depth of a stone by the best evidence.

What the record of the stone states comes first, a measurement unless it says that a rule was its origin; then the
archaeologist's rule for its kind in its course or part of the building; then the rule for its kind; then the rule for
the whole structure.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from ground.errors import SurveyError
from survey.records.survey import BlockRecord, DepthRule

Origin = Literal["stone", "rule", "kind", "structure", "solid"]
"""Origin of a depth: the stone itself, a rule for course or zone, its kind, the structure, or an imported solid."""


@dataclass(frozen=True)
class Depth:
    """The depth of one stone behind its face.

    Attributes
    ----------
    value : [m]
    sigma : standard deviation [m]; None if not known
    source : the evidence, in words
    origin : kind of the evidence
    line : line of the survey file that states it
    """

    value: float
    sigma: float | None
    source: str
    origin: Origin
    line: int


def depth_for(record: BlockRecord, rules: Sequence[DepthRule]) -> Depth:
    """Find the depth of a stone by the best evidence.

    Parameters
    ----------
    record : one stone of a survey
    rules : the depth rules of the survey

    Raises
    ------
    SurveyError
        if no rule gives the stone's depth, or two equally specific rules do
    """
    if record.depth is not None:
        source = record.depth_source or "measured on the stone"
        origin = _STATED.get(record.depth_origin or "stone", "stone")
        return Depth(record.depth, record.depth_sigma, source, origin, record.line)
    where = f"stone {record.code} (line {record.line})"
    holding = [rule for rule in rules if _holds(rule, record)]
    if not holding:
        raise SurveyError(
            f"no depth is known for a {record.kind}",
            where=where,
            remedy=f"measure it, or state 'depth {record.kind} D source TEXT' in the head of the survey, or in a "
            "header file (begun by 'moma-survey 1') that --header names",
        )
    best = max(holding, key=_rank)
    alike = sorted(rule.line for rule in holding if _rank(rule) == _rank(best))
    if len(alike) > 1:
        raise SurveyError(
            f"the depth rules of lines {alike[0]} and {alike[1]} both hold for it",
            where=where,
            remedy="let one rule hold for each stone, or give the stone a depth of its own",
        )
    return Depth(best.depth, best.sigma, best.source, _ORIGINS[_rank(best)], best.line)


_STATED: Mapping[str, Origin] = {"rule": "rule", "kind": "kind", "structure": "structure"}
"""Origins of depths that a record may state though they were not measured on the stone."""

_ORIGINS: tuple[Origin, ...] = ("structure", "kind", "rule", "rule")


def _holds(rule: DepthRule, record: BlockRecord) -> bool:
    if rule.kind not in (None, record.kind) or rule.zone not in (None, record.zone):
        return False
    if rule.courses is None:
        return True
    return record.course is not None and rule.courses[0] <= record.course <= rule.courses[1]


def _rank(rule: DepthRule) -> int:
    """Return how specific a rule is: structure 0, kind 1, kind in a course or zone 2, in a course of a zone 3."""
    if rule.kind is None:
        return 0
    return 1 + (rule.courses is not None) + (rule.zone is not None)
