"""List of what somebody should look at before the stones of a drawing are believed."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Doubtful:
    """An outline that should be looked at.

    Attributes
    ----------
    code : of the stone
    reason : in a word or two: "overlap", "odd size", "covered", …
    text : in words, with numbers
    where : the outline's place in its file
    """

    code: str
    reason: str
    text: str
    where: str
