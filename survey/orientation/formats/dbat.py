"""Scripts of the Damped Bundle Adjustment Toolbox: XML that names tables of control points, photographs, marks.

    document/input[@base_dir]
        ctrl_pts/file[@format], check_pts/file, each with filters by id that keep or remove
        images/file[@format="id,path"]
        prior_eo/file[@format="id,x,y,z,omega,phi,kappa"]: start values; with deviations sx, sy, sz or sxyz, so, sp, sk
            observations; angles in the unit @units, radians or degrees
        image_pts/file[@format="im,id,x,y,sxy"], the precision also as an attribute sxy [px]
        cameras/camera: name, unit, sensor, image, focal, cc, pp, K, P, aspect, skew, model
    document/operations: set_bundle_estimate_params/io names what is calibrated

Tables have commas between their values. As in its result files since version 0.9.1.2, the principal point counts to the
right and down from the upper left corner, and K and P have the signs of a correction; the aspect of backward models is
1 - as. The operations themselves are not run: start values that are not given are found here.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path, PurePosixPath
from xml.sax.saxutils import escape

import numpy as np

from ground.errors import SurveyError
from ground.tables.numbers import parse_number, shown
from ground.tables.rows import TextRows
from survey.arrays import Array
from survey.orientation.formats.control import ControlRow, with_control, write_control
from survey.orientation.formats.marks import MarkRow, network_of
from survey.orientation.formats.xml_lines import Element, read_xml
from survey.orientation.network import INTERIOR, Camera, Network, Photo, listed
from survey.orientation.rotations import angles, from_angles

_PARTS = {
    "cc": ("c",),
    "pp": ("xp", "yp"),
    "aspect": ("as",),
    "skew": ("sk",),
    "K": ("K1", "K2", "K3"),
    "P": ("P1", "P2"),
}
_DEFAULT = 1.0  # standard deviation of marks that state none [px]


def read_dbat(path: Path) -> Network:
    """Read a script and its tables.

    Raises
    ------
    SurveyError
        naming file and line
    """
    document = read_xml(path, "document")
    entries = document.need("input")
    base = _base(path, entries)
    free = _estimated(document)
    cameras = tuple(_camera(camera, free) for camera in _cameras(entries, base))
    if len(cameras) != 1:
        raise entries.fail(f"{len(cameras)} cameras", "scripts of one camera can be read")
    images = [row for file in entries.all("images", "file") for row in _table(file, base, ("id", "path"))]
    photos = tuple(
        Photo(PurePosixPath(str(row["path"]).replace("\\", "/")).name, 0, where=str(row["where"]))
        for row in images
    )
    photos = _prior(entries, base, images, photos)
    number = {str(row["id"]): photo.name for row, photo in zip(images, photos, strict=True)}
    if not photos:
        raise entries.fail("the script has no images", "give images/file")
    marks, source = list[MarkRow](), str(path)
    for file in entries.all("image_pts", "file"):
        default = file.attributes.get("sxy")
        for row in _table(file, base, ("im", "id", "x", "y")):
            where = str(row["where"])
            if str(row["im"]) not in number:
                raise SurveyError(
                    f"no image {row['im']}", where=where, remedy=f"known are {', '.join(number)}"
                )
            sigma = row.get("sxy", default)
            value = None if sigma is None else parse_number(str(sigma), "sxy", where)
            source, line = where.rpartition(":")[0], int(where.rpartition(":")[2])
            x, y = (parse_number(str(row[name]), name, where) for name in "xy")
            marks.append(MarkRow(number[str(row["im"])], str(row["id"]), x, y, value, line))
    network = network_of(source, tuple(marks), cameras, photos, _DEFAULT)
    control, checks = (_points(entries, base, part) for part in ("ctrl_pts", "check_pts"))
    if not (control or checks):
        return network
    rows = {check.number: check for check in (*checks, *control)}
    only = tuple(
        check.number
        for check in checks
        if check.number not in {row.number for row in control} and check.number in network.names
    )
    return with_control(network, tuple(rows.values()), check=only)


def _points(section: Element, base: Path, part: str) -> list[ControlRow]:
    """Return the points of one part of a script: those of its tables that its filter keeps."""
    tables = (_table(file, base, ("id", "x", "y", "z")) for file in section.all(part, "file"))
    return _filtered(section.find(part), [_control(row) for table in tables for row in table])


def _base(path: Path, section: Element) -> Path:
    text = section.attributes.get("base_dir", "$HERE")
    if text.startswith("$DBAT"):
        raise section.fail(
            "the folder of the toolbox, $DBAT, is not known here", 'write base_dir="$HERE", or a path'
        )
    if text.startswith("$HERE"):
        return path.parent / text.replace("$HERE", ".", 1)
    return Path(text.replace("$HOME", str(Path.home()), 1))


def _prior(
    section: Element, base: Path, images: list[Mapping[str, object]], photos: tuple[Photo, ...]
) -> tuple[Photo, ...]:
    """Return the photographs with the stations and angles that are known beforehand."""
    places = {str(row["id"]): k for k, row in enumerate(images)}
    out = list(photos)
    for file in section.all("prior_eo", "file"):
        unit = file.attributes.get("units", "radians").strip().lower()
        if unit not in ("degrees", "radians"):
            raise file.fail(f"angles in {shown(unit)}", 'write units="degrees" or "radians"')
        for row in _table(file, base, ("id",)):
            where = str(row["where"])
            if str(row["id"]) not in places:
                raise SurveyError(
                    f"no image {row['id']}", where=where, remedy=f"known are {listed(list(places))}"
                )
            k = places[str(row["id"])]
            out[k] = _placed(out[k], row, where, np.pi / 180.0 if unit == "degrees" else 1.0)
    return tuple(out)


def _placed(photo: Photo, row: Mapping[str, object], where: str, radian: float) -> Photo:
    """Return a photograph with one row of a table of stations and angles."""

    def three(names: tuple[str, str, str], *common: str) -> Array | None:
        """Return three numbers (3,) of named columns, None where all are absent; raise `SurveyError` where some are."""
        texts = [
            row.get(name, next((row[alias] for alias in common if alias in row), None)) for name in names
        ]
        if all(text is None for text in texts):
            return None
        if any(text is None for text in texts):
            raise SurveyError(
                f"some of {', '.join(names)} without the others",
                where=where,
                remedy="give all of them, or none",
            )
        return np.array(
            [parse_number(str(text), name, where) for text, name in zip(texts, names, strict=True)]
        )

    station, station_sigma = three(("x", "y", "z")), three(("sx", "sy", "sz"), "sxyz")
    angles, angle_sigma = three(("omega", "phi", "kappa")), three(("so", "sp", "sk"))
    for sigma in (station_sigma, angle_sigma):
        if sigma is not None and not (sigma > 0.0).all():
            raise SurveyError(
                f"a deviation of {sigma.min():g}",
                where=where,
                remedy="give more than 0, or leave these columns out",
            )
    rotation = None if angles is None else from_angles(*(radian * angles))
    observed = station is not None and station_sigma is not None
    turned = rotation is not None and angle_sigma is not None
    return replace(
        photo,
        station=station,
        rotation=rotation,
        observed_station=station if observed else None,
        station_sigma=station_sigma if observed else None,
        observed_rotation=rotation if turned else None,
        angle_sigma=radian * angle_sigma if turned and angle_sigma is not None else None,
    )


def _table(file: Element, base: Path, needed: tuple[str, ...]) -> list[Mapping[str, object]]:
    """Read a table by the names of its columns; `where` is added to each row."""
    columns = [word.strip() for word in file.attribute("format").split(",")]
    missing = [column for column in needed if column not in columns]
    if missing:
        raise file.fail(
            f"the format {file.attributes['format']!r} has no {missing[0]}", f"it needs {', '.join(needed)}"
        )
    rows = TextRows(base / file.text.strip())
    rows.delimiter = ","
    out = list[Mapping[str, object]]()
    for line, text in rows:
        words = rows.cells(text, line)
        where = f"{rows.path}:{line}"
        if len(words) != len(columns):
            raise SurveyError(
                f"a row of {len(words)} values", where=where, remedy=f"its columns are {', '.join(columns)}"
            )
        out.append({**dict(zip(columns, words, strict=True)), "where": where})
    return out


def _control(row: Mapping[str, object]) -> ControlRow:
    where = str(row["where"])
    place = [parse_number(str(row[name]), name, where) for name in "xyz"]
    common = row.get("sxyz", row.get("sxy"))
    deviations = [row.get(f"s{axis}", common if axis != "z" or "sxyz" in row else None) for axis in "xyz"]
    sigma = [
        0.0 if deviation is None else parse_number(str(deviation), "a deviation", where)
        for deviation in deviations
    ]
    if any(sigma) and not all(sigma):
        raise SurveyError("a deviation of 0 beside others", where=where, remedy="give all of them, or none")
    return ControlRow(
        str(row["id"]), str(row.get("label", "")), np.array(place), np.diag(np.square(sigma)), where
    )


def _filtered(part: Element | None, rows: list[ControlRow]) -> list[ControlRow]:
    for part_filter in () if part is None else part.all("filter"):
        ids = {word.strip() for word in part_filter.attribute("id").split(",")}
        what = part_filter.text.strip()
        if what not in ("keep", "remove"):
            raise part_filter.fail(f"a filter that says {shown(what)}", "write keep or remove")
        rows = [row for row in rows if (row.number in ids) == (what == "keep")]
    return rows


def _cameras(section: Element, base: Path) -> list[Element]:
    out = list(section.all("cameras", "camera"))
    for file in section.all("cameras", "file"):
        out += read_xml(base / file.text.strip(), "document").all("cameras", "camera")
    return out


def _camera(element: Element, free: tuple[str, ...]) -> Camera:
    def values(name: str, count: int) -> list[float]:
        """Return the numbers of a child element, or as many zeros where it is absent or empty."""
        value = element.find(name)
        return [0.0] * count if value is None or not value.text.strip() else value.numbers()

    image = [int(value) for value in element.need("image").numbers(2)]
    sensor = element.need("sensor").text.split(",")
    if len(sensor) != 2:
        raise element.need("sensor").fail(
            "a sensor without width and height", "write WIDTH,HEIGHT or auto,HEIGHT"
        )
    height = parse_number(sensor[1].strip(), "the sensor", element.need("sensor").where)
    pixel = height / image[1]
    cc, pp = values("cc", 1), values("pp", 2)
    c = cc[0] if len(cc) == 1 and cc[0] else values("focal", 1)[0]
    aspect = values("aspect", 1)[0] or 1.0
    width = (
        image[0] * pixel
        if sensor[0].strip() == "auto"
        else parse_number(sensor[0].strip(), "the sensor", element.need("sensor").where)
    )
    if sensor[0].strip() != "auto" and abs(width / image[0] / pixel - 1.0) > 0.05:
        raise element.need("sensor").fail(
            f"pixels of {width / image[0]:g} × {pixel:g} mm", "check the sensor's size"
        )
    xp, yp = (pp[0], pp[1]) if len(pp) == 2 and any(pp) else (0.5 * width, 0.5 * height)
    radial, tangential = (values("K", 3) + [0.0] * 3)[:3], (values("P", 2) + [0.0] * 2)[:2]
    model = element.find("model")
    number = 1 if model is None else int(model.numbers(1)[0])
    if number not in (-1, 1, 2, 3, 4, 5):
        raise element.fail(f"lens distortion model {number}", "models -1 and 1 to 5 are known")
    name = element.find("name")
    side = 1.0 if number < 0 else -1.0  # a correction has the opposite sign
    inner = np.array(
        [
            c,
            xp,
            yp,
            side * (aspect - 1.0),
            values("skew", 1)[0],
            *radial,
            *tangential,
        ]
    )
    return Camera(
        "camera1" if name is None else name.text.strip(),
        inner,
        (image[0], image[1]),
        pixel,
        "mm",
        number < 0,
        free,
        element.where,
    )


def _estimated(document: Element) -> tuple[str, ...]:
    """Return the parameters of the camera that the script estimates."""
    choice = next(
        (
            e
            for path in (("operations",), ("operations", "operation"))
            for e in document.all(*path, "set_bundle_estimate_params", "io")
        ),
        None,
    )
    if choice is None:
        return ()
    whole = choice.find("all")
    chosen = set(INTERIOR) if whole is not None and whole.text.strip() == "true" else set()
    for child in choice.children:
        if child.name == "all":
            continue
        names = _PARTS.get(child.name) or ((child.name,) if child.name in INTERIOR else None)
        if names is None or child.text.strip() not in ("true", "false"):
            raise child.fail(
                f"<{child.name}> {shown(child.text.strip())}", f"write true or false for {', '.join(_PARTS)}"
            )
        chosen = chosen | set(names) if child.text.strip() == "true" else chosen - set(names)
    return tuple(name for name in INTERIOR if name in chosen)


def write_dbat(network: Network, folder: Path) -> Path:
    """Write a script with its tables into a folder; return its path.

    Raises
    ------
    SurveyError
        if there are several cameras, or one in pixels
    """
    if len(network.cameras) != 1 or network.cameras[0].unit != "mm":
        raise SurveyError(
            "several cameras, or one in pixels", where=str(folder), remedy="use one camera, in millimetres"
        )
    camera = network.cameras[0]
    folder.mkdir(parents=True, exist_ok=True)
    rows = [
        ControlRow(network.names[gcp.point], network.names[gcp.point], gcp.place, gcp.covariance)
        for gcp in network.control
    ]
    kinds = {"control": [r for r, gcp in zip(rows, network.control, strict=True) if not gcp.check]}
    kinds["check"] = [r for r, gcp in zip(rows, network.control, strict=True) if gcp.check]
    tables = []
    for kind, tag in (("control", "ctrl_pts"), ("check", "check_pts")):
        if kinds[kind]:
            tables.append(
                f'<{tag}><file format="{_control_table(kinds[kind], folder / f"{kind}.txt")}">{kind}.txt</file></{tag}>'
            )
    _lines(folder / "images.txt", [f"{k}, {photo.name}" for k, photo in enumerate(network.photos, start=1)])
    prior = _prior_table(network, folder / "stations.txt")
    marks = [
        ", ".join(
            [
                str(network.photo[k] + 1),
                network.names[network.point[k]],
                *map(repr, network.image[k].tolist()),
                repr(float(np.sqrt((network.sigma[k] ** 2).mean()))),
            ]
        )
        for k in range(len(network.photo))
    ]
    _lines(folder / "marks.txt", marks)
    inner = dict(zip(INTERIOR, camera.inner.tolist(), strict=True))
    width, height = camera.size
    side = 1.0 if camera.forward else -1.0
    k, p = (",".join(repr(inner[name]) for name in names) for names in (_PARTS["K"], _PARTS["P"]))
    estimated = "".join(f"<{name}>true</{name}>" for name in camera.free)
    script = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<document dbat_script_version="1.0">',
        '<input base_dir="$HERE">',
        *tables,
        '<images><file format="id,path">images.txt</file></images>',
        *prior,
        '<image_pts><file format="im,id,x,y,sxy">marks.txt</file></image_pts>',
        "<cameras><camera>",
        f"<name>{escape(camera.name)}</name>",
        "<unit>mm</unit>",
        f"<sensor>auto,{camera.pixel * height!r}</sensor>",
        f"<image>{width},{height}</image>",
        f"<cc>{inner['c']!r}</cc>",
        f"<pp>{inner['xp']!r},{inner['yp']!r}</pp>",
        f"<aspect>{1.0 + side * inner['as']!r}</aspect>",
        f"<skew>{inner['sk']!r}</skew>",
        f"<K>{k}</K>",
        f"<P>{p}</P>",
        f"<model>{-1 if camera.forward else 3}</model>",
        "</camera></cameras>",
        "</input>",
        "<operations><set_bundle_estimate_params>",
        f"<io><all>false</all>{estimated}</io>",
        "</set_bundle_estimate_params></operations>",
        "</document>",
    ]
    _lines(folder / "project.xml", script)
    return folder / "project.xml"


def _prior_table(network: Network, path: Path) -> tuple[str, ...]:
    """Write stations and angles, observed ones with their deviations; return the lines of the script.

    Photographs with different columns are in tables of their own: `path`, and others with a number behind its name.
    """
    tables: dict[str, list[str]] = {}
    for k, photo in enumerate(network.photos, start=1):
        columns, values = ["id"], list[float]()
        station = photo.station if photo.observed_station is None else photo.observed_station
        rotation = photo.rotation if photo.observed_rotation is None else photo.observed_rotation
        for names, row in (
            ("x,y,z", station),
            ("sx,sy,sz", None if photo.observed_station is None else photo.station_sigma),
            ("omega,phi,kappa", None if rotation is None else np.degrees(angles(rotation))),
            ("so,sp,sk", None if photo.angle_sigma is None else np.degrees(photo.angle_sigma)),
        ):
            if row is not None:
                columns.append(names)
                values += row.tolist()
        if values:
            tables.setdefault(",".join(columns), []).append(", ".join([str(k), *map(repr, values)]))
    files = []
    for number, (names, rows) in enumerate(tables.items(), start=1):
        table = path if number == 1 else path.with_stem(f"{path.stem}-{number}")
        _lines(table, rows)
        files.append(f'<file format="{names}" units="degrees">{table.name}</file>')
    return ("<prior_eo>", *files, "</prior_eo>") if files else ()


def _control_table(rows: list[ControlRow], path: Path) -> str:
    weighted = [bool(row.covariance.any()) for row in rows]
    if any(weighted) and not all(weighted):
        raise SurveyError(
            "fixed control points beside weighted ones", where=str(path), remedy="weight all, or none"
        )
    write_control([replace(row, covariance=np.zeros((3, 3))) for row in rows], path)
    if not any(weighted):
        return "id,label,x,y,z"
    text = ["# number, name, X, Y, Z, standard deviations"]
    for row in rows:
        values = [*row.place.tolist(), *np.sqrt(np.diag(row.covariance)).tolist()]
        text.append(", ".join([row.number, row.name, *map(repr, values)]))
    _lines(path, text)
    return "id,label,x,y,z,sx,sy,sz"


def _lines(path: Path, lines: list[str]) -> None:
    path.write_text("\n".join([*lines, ""]), encoding="utf-8", newline="\n")
