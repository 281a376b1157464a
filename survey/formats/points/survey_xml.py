"""Points of LandXML and of Trimble's JobXML.

LandXML: ``CgPoint`` with northing, easting and elevation, in the linear unit of ``Units``; the description is its
``code``, else ``desc``, else its name. JobXML: the reduced points (``Reductions/Point``), else those of the field book
with a ``Grid``; metres; deleted ones are passed over, and points of instrument stations are stations. Where the code is
that of a feature, the values of its attributes follow it in the description: "MASONRY 12-3 E". Files are read piece by
piece.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from xml.parsers import expat

from ground.errors import SurveyError
from ground.tables.numbers import parse_number, shown, unreadable
from ground.units import CENTI, FOOT, INCH, KILO, MILLI, SURVEY_FOOT
from survey.formats.fields import code_of
from survey.formats.options import ReadingOptions
from survey.formats.tables.reader import PointCollector
from survey.records.survey import SurveyStream

_METRIC = {"meter": 1.0, "metre": 1.0, "millimeter": MILLI, "centimeter": CENTI, "kilometer": KILO}
_LINEAR = {**_METRIC, "foot": FOOT, "ussurveyfoot": SURVEY_FOOT, "inch": INCH}

Element = Callable[[str, Mapping[str, str], str, int], None]


def open_landxml(path: Path, options: ReadingOptions | None = None) -> SurveyStream:
    """Read the points of a LandXML file and return its stones one by one; see `open_gsi`."""
    path, options = Path(path), options or ReadingOptions()
    collector = PointCollector(path, options, unique=False)
    unit = [options.scale]
    count = [0]
    values: list[str] = []

    def element(where: str, attributes: Mapping[str, str], text: str, line: int) -> None:
        """Collect a unit, an attribute or a point at its end."""
        name = where.rpartition("/")[2]
        if name in ("Metric", "Imperial"):
            linear = attributes.get("linearUnit", "meter").casefold()
            if linear not in _LINEAR:
                raise collector.fail(line, f"unknown linear unit {shown(linear)}", "export in metres")
            unit[0] = _LINEAR[linear]
        elif name == "Property":
            values.append(attributes.get("value", "").strip())
        elif name == "CgPoint" and text.strip():
            words = text.split()
            if len(words) != 3:
                raise collector.fail(
                    line, f"a point of {len(words)} numbers", "give northing, easting and elevation"
                )
            at = f"{path}:{line}"
            north, east, up = (unit[0] * parse_number(word, "coordinate", at) for word in words)
            number = attributes.get("name") or attributes.get("oID") or ""
            count[0] += 1
            code = attributes.get("code") or attributes.get("desc") or number
            collector.add(number, _described(collector, code, values), (east, north, up), line)
            values.clear()

    _parse(path, element)
    return _stream(collector, path, count[0], "CgPoint")


def open_jobxml(path: Path, options: ReadingOptions | None = None) -> SurveyStream:
    """Read the points of a JobXML file and return its stones one by one; see `open_gsi`."""
    path, options = Path(path), options or ReadingOptions()
    collector = PointCollector(path, options, unique=False)
    elements: dict[str, list[tuple[dict[str, str], int]]] = {"Point": [], "PointRecord": []}
    stations: set[str] = set()
    now: dict[str, str] = {}
    values: list[str] = []
    of_points: dict[str, list[str]] = {}  # values of attributes, which the field book alone may have

    def element(where: str, given: Mapping[str, str], text: str, line: int) -> None:
        """Collect an attribute, a station or a point at its end."""
        parent, _, name = where.rpartition("/")
        if name in elements and parent.rpartition("/")[2] in ("Reductions", "FieldBook"):
            elements[name].append((dict(now), line))
            if values:
                of_points[now.get("Name", "")] = list(values)
            now.clear()
            values.clear()
        elif where.endswith("Feature/Attribute/Value"):
            values.append(text.strip())
        elif name == "StationRecord" and "StationName" in now:
            stations.add(now["StationName"])
            now.clear()
        elif name.endswith("Record"):
            now.clear()
        elif name in ("North", "East", "Elevation"):
            if parent.rpartition("/")[2] in ("Grid", "ComputedGrid"):
                now.setdefault(name, text.strip())
        elif name in ("Name", "Code", "StationName", "Deleted", "Description1"):
            now.setdefault(name, text.strip())

    _parse(path, element)
    count = 0
    for attributes, line in elements["Point"] or elements["PointRecord"]:
        if attributes.get("Deleted", "").casefold() == "true" or not all(
            attributes.get(k) for k in ("North", "East", "Elevation")
        ):
            continue
        at = f"{path}:{line}"
        north, east, up = (parse_number(attributes[k], k.lower(), at) for k in ("North", "East", "Elevation"))
        name = attributes.get("Name", "")
        if name in stations:
            collector.add_station(code_of(name) or name, (east, north, up), line)
            continue
        count += 1
        code = attributes.get("Code") or attributes.get("Description1") or name
        collector.add(name, _described(collector, code, of_points.get(name, ())), (east, north, up), line)
    return _stream(collector, path, count, "Point with a Grid")


def _described(collector: PointCollector, code: str, values: Sequence[str]) -> str:
    """Return the description of a point: its code, with the values of its attributes if it alone is not of the form."""
    stated = [value for value in values if value]
    return code if not stated or collector.template.parse(code) is not None else " ".join((code, *stated))


def _stream(collector: PointCollector, path: Path, count: int, what: str) -> SurveyStream:
    collector.close()
    if not count:
        raise SurveyError(
            f"the file has no {what}", where=str(path), remedy="export its points with coordinates"
        )
    return SurveyStream(collector.head, collector.table.records(), remarks=collector.remarks)


def _parse(path: Path, element: Element) -> None:
    """Call `element` at the end of each, with its path, attributes, text and line."""
    open_: list[tuple[str, Mapping[str, str], list[str], int]] = []
    parser = expat.ParserCreate(namespace_separator="|")
    parser.buffer_text = True

    def start(name: str, attributes: Mapping[str, str]) -> None:
        """Open an element."""
        bare = name.rpartition("|")[2]
        where = f"{open_[-1][0]}/{bare}" if open_ else bare
        open_.append((where, attributes, [], parser.CurrentLineNumber))

    def end(_: str) -> None:
        """Close an element, and hand it on."""
        where, attributes, text, line = open_.pop()
        element(where, attributes, "".join(text), line)

    def text(some: str) -> None:
        """Add text to the innermost element."""
        if open_:
            open_[-1][2].append(some)

    def refuse(*_: object) -> None:
        """Refuse entities, by which small files could grow without limit."""
        raise SurveyError(
            "the file declares entities", where=f"{path}:{parser.CurrentLineNumber}", remedy="export it again"
        )

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler, parser.EntityDeclHandler = text, refuse
    try:
        with path.open("rb") as handle:
            parser.ParseFile(handle)
    except expat.ExpatError as error:
        what = f"not whole XML: {expat.ErrorString(error.code)}"
        raise SurveyError(what, where=f"{path}:{error.lineno}", remedy="export the file again") from error
    except (OSError, ValueError) as error:
        raise unreadable(path, error, "give an existing survey file") from error
