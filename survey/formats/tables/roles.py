"""Roles of points, corner, point on the face, station or control point, by the words that people write for them."""

from collections.abc import Mapping

from ground.errors import UsageError
from ground.tables.numbers import shown

STATION = "station"
"""The role of a position of the instrument."""

CONTROL = "control"
"""The role of a control point, which belongs to no stone."""

ROLES: Mapping[str, str] = {
    **dict.fromkeys(("v", "vertex", "corner", "edge", "outline"), "vertex"),
    **dict.fromkeys(("e", "ecke", "eckpunkt", "rand", "sommet", "coin", "vertice", "spigolo", "esquina"), "vertex"),
    **dict.fromkeys(("vértice", "ep"), "vertex"),
    # line codes of field software: a line begins, goes on, ends, is closed
    **dict.fromkeys(("b", "beg", "begin", "start", "l", "line", "end", "c", "cls", "close"), "vertex"),
    **dict.fromkeys(("p", "point", "pt", "face", "surface", "f", "punkt", "fläche", "flaeche"), "point"),
    **dict.fromkeys(("flächenpunkt", "face point", "punto", "superficie", "faccia", "cara", "fl", "flp"), "point"),
    **dict.fromkeys(("parement", "intérieur", "inside", "innen", "interno", "interior"), "point"),
    **dict.fromkeys(("m", "mitte", "middle", "centre", "center", "milieu", "mezzo", "centro"), "point"),
    **dict.fromkeys(("s", "st", "stn", "stp", "station", "standpunkt", "stazione", "estación"), STATION),
}  # fmt: skip
"""Roles of points of stones, and of stations, by the words for them."""

_CONTROL_WORDS = (
    *("fp", "festpunkt", "pp", "passpunkt", "gcp", "control", "tie", "appui", "punto fisso", "punto fijo"),
    *("kontrollpunkt", "hilfspunkt", "anschlusspunkt", "lfp", "lfp3", "hfp", "hfp3"),
)


def roles_with(words: Mapping[str, str]) -> Mapping[str, str]:
    """Return roles by all words for them; those of the user go before others."""
    return {**ROLES, **dict.fromkeys(_CONTROL_WORDS, CONTROL), **words}


def role_of(text: str, roles: Mapping[str, str]) -> str | None:
    """Return the role that a word stands for, with a number or without: E, E1, corner 3; None if it is not known."""
    word = text.casefold()
    return roles.get(word) or roles.get(word.rstrip("0123456789").rstrip())


def is_bare(description: str, roles: Mapping[str, str]) -> bool:
    """Return whether a description only says that its point is a station or a control point."""
    return roles.get(description.strip().casefold()) in (STATION, CONTROL)


def read_roles(text: str) -> Mapping[str, str]:
    """Read words for roles: ``Fl=point,HP=control``.

    Raises
    ------
    UsageError
        if it is not of words and roles
    """
    usual = roles_with({})
    roles: dict[str, str] = {}
    for pair in filter(None, map(str.strip, text.split(","))):
        word, _, meaning = map(str.strip, pair.casefold().partition("="))
        if not word or meaning not in usual:
            raise UsageError(
                f"{shown(pair)} is not a word and a role",
                where="--roles",
                remedy='write e.g. --roles "Fl=point,HP=control"; roles are vertex, point, station and control',
            )
        roles[word] = usual[meaning]
    return roles
