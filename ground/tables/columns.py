"""Names of columns of tables: how they are compared, coordinates in five languages, and units in names.

Names are compared without case, accents, blanks and punctuation. A unit may follow in brackets, after ``in``, or after
an underscore: ``x [mm]``, ``Tiefe (cm)``, ``Höhe in m``, ``x_mm``.
"""

import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence

from ground.errors import SurveyError
from ground.tables.numbers import shown
from ground.units import LENGTHS

LONGEST_HEAD = 100
"""Lines before the first row of a table, at most."""

COORDINATES: Mapping[str, Sequence[str]] = {
    # English; German; French; Italian; Spanish
    "x": (
        *("x", "easting", "east", "e", "coord x", "x coord", "x coordinate", "pos x", "point x"),
        *("Rechts", "Rechtswert", "Ost", "Ostwert", "rw", "x Koordinate", "x Wert", "y Rechts"),
        *("est", "coordonnée x", "abscisse", "coordinata x", "este", "coordenada x"),
    ),
    "y": (
        *("y", "northing", "north", "n", "coord y", "y coord", "y coordinate", "pos y", "point y"),
        *("Hoch", "Hochwert", "Nord", "Nordwert", "hw", "y Koordinate", "y Wert", "x Hoch"),
        *("coordonnée y", "ordonnée", "coordinata y", "norte", "coordenada y"),
    ),
    "z": (
        *("z", "elevation", "elev", "height", "h", "coord z", "z coord", "z coordinate", "pos z"),
        *("Höhe ü M", "Höhe ü NN", "Höhe über NN", "Höhe NHN", "H ü M", "Kote", "altitude NGF", "quota slm"),
        *("Höhe", "z Koordinate", "z Wert", "Punkthöhe", "altitude", "alt", "hauteur", "coordonnée z"),
        *("quota", "altezza", "coordinata z", "cota", "altura", "elevación", "coordenada z", "point z"),
    ),
}
"""Names of columns of coordinates by axis; in doubt the first."""

SIGMA: Sequence[str] = (
    *("sigma", "σ", "std", "std dev", "stdev", "standard deviation", "accuracy", "precision"),
    *("Genauigkeit", "Standardabweichung", "mittlerer Fehler", "Punktfehler", "mittlerer Punktfehler"),
    *("écart type", "précision", "scarto tipo", "deviazione standard", "precisione"),
    *("desviación estándar", "desviación típica", "precisión"),
)
"""Names of columns of standard deviations."""

POINT: Sequence[str] = (
    *("point", "point number", "point no", "point id", "point name", "pid", "pt", "pt id", "vertex id"),
    *("Punkt", "Punktnummer", "Punkt Nr", "PktNr", "Pkt", "Pkt Nr", "PNr", "Punkt ID", "Punktname"),
    *("numéro de point", "n° point", "numero punto", "n punto", "punto", "id punto"),
    *("número de punto", "nombre del punto", "nome punto", "no", "nr", "num", "number"),
    *("Nummer", "numéro", "numero", "número", "id"),
)
"""Names of columns of numbers or names of points."""

_UNIT = re.compile(
    r"(?P<name>.*?)(?:\s*[\[(]\s*(?P<a>[^\])]*?)\s*[\])]|\s+in\s+(?P<b>[a-z]+)|[_/](?P<c>mm|cm|dm|m|ft|in))",
    re.IGNORECASE,
)
_BRACKETS = re.compile(r"[\[(][^\])]*[\])]")
_ZEROS = frozenset(
    ("um", "unn", "ubernn", "nn", "nhn", "unhn", "ngf", "slm", "snm", "asl", "amsl", "abovesealevel")
)
"""What heights are counted from, as it follows their unit: metres above the sea, in plain spelling."""
_WORDS = {"metre": "m", "metres": "m", "meter": "m", "meters": "m", "millimeter": "mm", "centimeter": "cm"} | {
    "millimetre": "mm", "millimetres": "mm", "centimetre": "cm", "feet": "ft", "foot": "ft", "inch": "in",
    "inches": "in", '"': "in", "'": "ft", "us survey feet": "us-ft", "us survey foot": "us-ft", "ftus": "us-ft",
    "us ft": "us-ft", "sft": "us-ft", "us feet": "us-ft", "usft": "us-ft",
}  # fmt: skip


def plain(name: str) -> str:
    """Return a name without case, accents, blanks and punctuation, by which names are compared."""
    folded = unicodedata.normalize("NFKD", name.casefold())
    return "".join(character for character in folded if character.isalnum())


def length_unit(text: str, height: bool = False) -> str | None:
    """Return the name in `LENGTHS` of a unit of length, however it is spelt; None if it is not known.

    Of a height, what it is counted from may follow.

    >>> length_unit("Metres"), length_unit("m ü. M.", height=True), length_unit("m ü. M."), length_unit("m/s")
    ('m', 'm', None, None)
    """
    bare = unicodedata.normalize("NFKC", text).strip().rstrip(".").casefold()
    unit, _, zero = bare.partition(" ")
    word = _WORDS.get(bare, unit if height and plain(zero) in _ZEROS else bare)
    return word if word in LENGTHS else None


def unit_of(name: str) -> tuple[str, str | None]:
    """Split the name of a column into the name itself and its unit, None if it has none.

    Examples
    --------
    >>> unit_of("Rechts [mm]"), unit_of("depth_cm"), unit_of("Höhe")
    (('Rechts', 'mm'), ('depth', 'cm'), ('Höhe', None))
    """
    match = _UNIT.fullmatch(name.strip())
    if match is None:
        return name.strip(), None
    unit = match["a"] or match["b"] or match["c"] or ""
    unit_name = length_unit(unit, plain(match["name"]) in _HEIGHTS)
    return (match["name"].strip(), unit_name) if unit_name is not None else (name.strip(), None)


def meaning_of(name: str, meanings: Mapping[str, str]) -> str | None:
    """Return what a column is by its name, without its unit or with it, or before a slash; None if it is not known.

    Parameters
    ----------
    name : of the column, ``X/Easting (m)``
    meanings : what columns are by the plain spelling of their names

    Examples
    --------
    >>> [meaning_of(name, {"x": "x", "sigmax": "sx"}) for name in ("x [mm]", "X/Easting", "Sigma_X/Easting_(m)", "k/x")]
    ['x', 'x', 'sx', None]
    """
    bare = _BRACKETS.sub("", unit_of(name)[0])
    for spelling in (bare, name, bare.partition("/")[0]):
        if (meaning := meanings.get(plain(spelling))) is not None:
            return meaning
    return None


def spellings(name: str) -> Iterable[str]:
    """Yield the plain forms of a name, with umlauts as one letter and as two."""
    yield plain(name)
    for umlaut, letters in (("ä", "ae"), ("ö", "oe"), ("ü", "ue")):
        if umlaut in name.casefold():
            yield plain(name.casefold().replace(umlaut, letters))


def length_scale(name: str, where: str) -> float | None:
    """Return the length of the unit in the name of a column [m]; None if it states none.

    Raises
    ------
    SurveyError
        if it states another unit
    """
    unit = unit_of(name)[1]
    if unit is not None:
        return LENGTHS[unit]
    if stated := re.search(r"\[\s*([^\]]+?)\s*\]", name):
        raise SurveyError(
            f"column {shown(name)} is in {shown(stated[1])}, which is not a unit of length",
            where=where,
            remedy=f"units are {', '.join(LENGTHS)}",
        )
    return None


_HEIGHTS = frozenset(spelling for name in COORDINATES["z"] for spelling in spellings(name))


def places_of(
    names: Sequence[str], wanted: Mapping[str, Sequence[str]], where: str, remedy: str = "leave one out"
) -> dict[str, int]:
    """Return the place, from 0, of each wanted column that a header names.

    Parameters
    ----------
    names : of the columns, in order
    wanted : names of columns by what they are
    where : place of the header, for errors

    Raises
    ------
    SurveyError
        if two columns are one thing

    Examples
    --------
    >>> places_of(["Pkt", "Hochwert [m]", "Rechtswert [m]", "Höhe"], COORDINATES, "points.csv:1")
    {'y': 1, 'x': 2, 'z': 3}
    """
    known = {
        spelling: what for what, alike in wanted.items() for name in alike for spelling in spellings(name)
    }
    places: dict[str, int] = {}
    for k, name in enumerate(names):
        what = meaning_of(name, known)
        if what is None:
            continue
        if what in places:
            raise SurveyError(
                f"columns {shown(names[places[what]])} and {shown(name)} are both {what}",
                where=where,
                remedy=remedy,
            )
        places[what] = k
    return places
