"""Closed solids from other programs: OBJ, PLY, STL, Gmsh MSH, COMPAS and LMGC90, one stone per object.

An object is an ``o`` (or ``g``) of OBJ, a ``solid`` of STL, a volume of MSH, a block of COMPAS, a polyhedron of LMGC90,
the whole of a PLY. Where one has several
bodies, each is a stone: NAME-1, NAME-2, … The name is parsed by the code template, {block}:{kind} by default; if it
does not fit, it is the code itself, blanks replaced by "_".

Coordinates stay as they are in the file unless snapping is asked for: then faces of neighbours that match within a
tolerance are brought into common planes (`survey.joints.snapping.snapping`), which needs all stones at once.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ground.errors import GeometryError, SurveyError, UsageError
from ground.tables.numbers import shown
from survey.conventions import TENTH
from survey.formats.fields import CODE, code_of
from survey.formats.options import ReadingOptions
from survey.formats.solids.bodies import ClosedBody, RawBody, closed_bodies
from survey.formats.solids.compas import compas_bodies
from survey.formats.solids.lmgc90 import lmgc90_bodies
from survey.formats.solids.msh.bodies import msh_bodies
from survey.formats.solids.obj import obj_bodies
from survey.formats.solids.ply import ply_bodies
from survey.formats.solids.stl import stl_bodies
from survey.formats.tables.code_template import CodeTemplate
from survey.geometry.solids import Solid, volume_of
from survey.geometry.watertight import check_watertight
from survey.joints.snapping.snapping import snap
from survey.records.snapping import Snapping
from survey.records.survey import Reject, SolidRecord, SurveyStream

_CODES = "{block}:{kind}"
_MOST_CHANGE = TENTH  # largest relative change of a stone's volume by snapping
_BODIES: Mapping[str, Callable[[Path], Iterator[RawBody]]] = {
    ".obj": obj_bodies,
    ".ply": ply_bodies,
    ".stl": stl_bodies,
    ".msh": msh_bodies,
    ".json": compas_bodies,
    ".dat": lmgc90_bodies,
}


def open_solids(path: Path, options: ReadingOptions | None = None) -> SurveyStream:
    """Open closed solids, of one file or of several that are one survey, which are then read one by one.

    Parameters
    ----------
    path : the file, whose ending names the format; of several files in `options`, their folder
    options : the code template of names; kind of stones whose names have none; the unit; the tolerance of snapping;
        the head of another file; the files that are one survey

    Raises
    ------
    SurveyError
        naming the file, and the line if it is text, if it is wrong as a whole; in a survey of several files such a
        file is a Reject
    UsageError
        if an ending is not known, or the code template has a field that solids do not have
    """
    options, path = options or ReadingOptions(), Path(path)
    template = CodeTemplate(options.codes or _CODES)
    for field in ("role", "zone"):
        if field in template.fields:
            raise UsageError(
                f"code template {template.text!r} has a {field}, which solids do not have",
                remedy="write e.g. {block}:{kind}",
            )
    for file in options.files or (path,):
        if file.suffix.lower() not in _BODIES:
            raise UsageError(
                f"ending {file.suffix!r} is not that of a format of solids",
                where=str(file),
                remedy=f"endings: {', '.join(_BODIES)}",
            )
    head = options.head_for(path)
    files = options.files
    records = _of_all(files, template, options) if files else _records(path, template, options, set())
    if not options.snap > 0.0:
        return SurveyStream(head, records)
    snapped, snapping = _snapped(list(records), options.snap, str(path))
    return SurveyStream(head, iter(snapped), snapping)


def _records(
    file: Path, template: CodeTemplate, options: ReadingOptions, known: set[str]
) -> Iterator[SolidRecord | Reject]:
    """Read the solids of one file; `known` collects the codes."""
    raw = list(_BODIES[file.suffix.lower()](file))
    if not raw:
        raise SurveyError("the file has no solids", where=str(file), remedy="export closed surfaces")
    return _Solids(file, template, options, known).records(raw)


def _of_all(
    files: Sequence[Path], template: CodeTemplate, options: ReadingOptions
) -> Iterator[SolidRecord | Reject]:
    """Read the solids of several files; one that cannot be read is a reject, since the others can be."""
    known: set[str] = set()
    for file in files:
        try:
            for record in _records(file, template, options, known):
                yield replace(record, file=str(file)) if isinstance(record, SolidRecord) else record
        except SurveyError as error:
            yield Reject(None, error)


def _snapped(
    found: list[SolidRecord | Reject], tolerance: float, path: str
) -> tuple[list[SolidRecord | Reject], Snapping]:
    """Bring matching faces of the stones into common planes."""
    records = [one for one in found if isinstance(one, SolidRecord)]
    if not records:
        return found, Snapping(tolerance, 0, 0, {}, {}, ())
    given = [Solid(record.code, record.vertices, record.faces) for record in records]
    solids, snapping = snap(given, tolerance)
    made = {one.code: _moved(one, solid, snapping, path) for one, solid in zip(records, solids, strict=True)}
    return [made[one.code] if isinstance(one, SolidRecord) else one for one in found], snapping


def _moved(record: SolidRecord, solid: Solid, snapping: Snapping, path: str) -> SolidRecord | Reject:
    """Return the moved stone if it is still a valid solid."""
    try:
        with np.errstate(all="ignore"):  # a body without volume is an error below, not a warning
            check_watertight(solid)
            _check_volume(record, solid)
    except GeometryError as error:
        where = f"{path}:{record.line}" if record.line else path
        what = f"solid {record.code}: within {snapping.tolerance:g} m of its corners {error.what}"
        remedy = "give a smaller tolerance with --snap"
        return Reject(record.code, SurveyError(what, where=where, remedy=remedy), record.spans)
    moved, folded = snapping.moved[record.code], snapping.folded.get(record.code, 0)
    text = f"snapped within {snapping.tolerance:g} m: corners moved by up to {moved:.2g} m"
    more = (f"{folded} faces folded for that",) if folded else ()
    return replace(record, vertices=solid.vertices, faces=solid.faces, remarks=(*record.remarks, text, *more))


def _check_volume(record: SolidRecord, solid: Solid) -> None:
    before = volume_of(Solid(record.code, record.vertices, record.faces))
    change = volume_of(solid) / before - 1.0
    if abs(change) > _MOST_CHANGE:
        raise GeometryError(f"its volume changes by {100.0 * change:.0f} %")


class _Solids:
    """Reader of the solids of a file."""

    def __init__(self, path: Path, template: CodeTemplate, options: ReadingOptions, known: set[str]) -> None:
        self._path, self._template, self._options, self._known = path, template, options, known

    def records(self, bodies: Sequence[RawBody]) -> Iterator[SolidRecord | Reject]:
        """Iterate over the bodies of a file; those of one name are numbered."""
        names = Counter(self._name(raw) for raw in bodies)
        numbers: Counter[str] = Counter()
        for raw in bodies:
            name = self._name(raw)
            yield from self._stones(raw, name, numbers if names[name] > 1 else None)

    def _name(self, raw: RawBody) -> str:
        parsed = self._template.parse(raw.name)
        name = raw.name if parsed is None else parsed.block
        return code_of(name) or name

    def _stones(
        self, raw: RawBody, name: str, numbers: Counter[str] | None
    ) -> Iterator[SolidRecord | Reject]:
        parsed = self._template.parse(raw.name)
        kind, course = (None, None) if parsed is None else (parsed.kind, parsed.course)
        found: list[ClosedBody | GeometryError] = []
        if raw.error is None:
            found = list(self._bodies(raw))
            numbers = numbers if numbers is not None or len(found) == 1 else Counter()
        elif numbers is None:
            yield self._reject(name, raw, raw.error)
        else:
            numbers[name] += 1
            yield self._reject(f"{name}-{numbers[name]}", raw, raw.error)
        for body in found:
            code = name
            if numbers is not None:
                numbers[name] += 1
                code = f"{name}-{numbers[name]}"
            if isinstance(body, GeometryError):
                yield self._reject(code, raw, self._error(code, raw, body.what, body.remedy))
            elif CODE.fullmatch(code) is None:
                remedy = "use letters, digits and . + / : - _, at most 64"
                yield self._reject(code, raw, self._error(code, raw, "that is not a code", remedy))
            elif code in self._known:
                remedy = "give every stone a name of its own"
                yield self._reject(code, raw, self._error(code, raw, "a second of that name", remedy))
            else:
                self._known.add(code)
                vertices, faces = body.solid.vertices, body.solid.faces
                own = kind or raw.kind or self._options.kind
                yield SolidRecord(code, own, course, vertices, faces, raw.line, remarks=_remarks(body))

    def _bodies(self, raw: RawBody) -> Iterator[ClosedBody | GeometryError]:
        """Make the closed bodies of one name, in metres and with z upwards."""
        options, unit = self._options, self._options.scale
        vertices = raw.vertices * unit
        if options.up == "y":
            x, y, z = vertices.T
            vertices = np.column_stack([x, -z, y])
        metric = replace(raw, vertices=vertices, resolution=raw.resolution * unit)
        repair = options.snap if options.repair is None and options.snap > 0.0 else options.repair
        return closed_bodies(metric, max(options.flat, options.snap), options.planes, repair)

    def _error(self, code: str, raw: RawBody, what: str, remedy: str | None) -> SurveyError:
        where = f"{self._path}:{raw.line}" if raw.line else str(self._path)
        return SurveyError(f"solid {shown(code)}: {what}", where=where, remedy=remedy)

    def _reject(self, code: str, raw: RawBody, error: SurveyError) -> Reject:
        spans = (range(raw.line, raw.end),) if raw.line else ()
        return Reject(code if CODE.fullmatch(code) else None, error, spans)


def _remarks(body: ClosedBody) -> tuple[str, ...]:
    """Describe the changes made to the faces."""
    out = [*body.repairs, *([body.scanned] if body.scanned else [])]
    if body.doubled:
        out.append(f"{body.doubled} faces were there twice")
    if body.folded:
        out.append(f"{body.folded} faces that are not plane were folded")
    return tuple(out)
