"""XML of cameras and markers as Agisoft Metashape exports it, both in one file or in two.

A chunk holds sensors with their calibrations, cameras with their transformation from the camera's axes (x to the
right, y
down, z forward) to those of the chunk, the chunk's own transformation to the world, markers with their places by
survey, and their marks on the photographs. Distortion is forward, of coordinates over the depth:

    u = w/2 + c_x + x' f + x' B₁ + y' B₂,   v = h/2 + c_y + y' f
"""

from dataclasses import replace
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from ground.errors import SurveyError
from ground.tables.numbers import parse_number
from survey.arrays import Array
from survey.orientation.formats.local_frame import LocalFrame
from survey.orientation.formats.marks import marked_well, marks_of_points
from survey.orientation.formats.xml_lines import Element, read_xml
from survey.orientation.network import Camera, Control, Network, Photo

_FLIP = np.diag([1.0, -1.0, -1.0])


def read_metashape(path: Path, markers: Path | None = None, sigma: float = 1.0) -> Network:
    """Read cameras and markers.

    Parameters
    ----------
    path : the file of the cameras
    markers : the file of the markers; None: the same
    sigma : standard deviation of marks, where the file states none [px]

    Raises
    ------
    SurveyError
        naming file and line
    """
    chunk = read_xml(path, "document").need("chunk")
    shown = [one for one in _grouped(chunk, "cameras", "camera") if _is_enabled(one)]
    known = {sensor.attribute("id"): sensor for sensor in chunk.all("sensors", "sensor")}
    for camera in shown:
        if camera.attribute("sensor_id") not in known:
            raise camera.fail(
                f"sensor {camera.attributes['sensor_id']} is not in the file", "export the cameras again"
            )
    # a project has sensors of photographs that were left out
    used = [number for number in known if any(one.attributes["sensor_id"] == number for one in shown)]
    sensors = {number: k for k, number in enumerate(used)}
    cameras = tuple(_camera(known[number]) for number in used)
    markers_chunk = chunk if markers is None else read_xml(markers, "document").need("chunk")
    frame = _local_frame(chunk, markers_chunk)
    worlds = {name: frame.moved(world) if frame else world for name, world in _worlds(chunk).items()}
    photos = {
        element.attribute("id"): _photo(
            element,
            sensors[element.attributes["sensor_id"]],
            worlds.get(element.attributes.get("component_id", ""), worlds[""]),
        )
        for element in shown
    }
    if not photos:
        raise chunk.fail("the chunk has no cameras", "export the cameras")
    source = path if markers is None else markers
    network = _network(source, markers_chunk, cameras, photos, sigma, _remarks(chunk, frame))
    return network if frame is None else _in_frame(network, frame)


def _remarks(chunk: Element, frame: LocalFrame | None) -> tuple[str, ...]:
    if frame is not None:
        lon, lat, height = frame.origin.tolist()
        return (
            f"places are metres to the east, north and up from longitude {lon:.8f}°, latitude {lat:.8f}°, "
            f"height {height:.3f} m (WGS 84)",
        )
    text = "" if (reference := chunk.find("reference")) is None else reference.text.strip()
    return ("the chunk is georeferenced: places are geocentric",) if text and "LOCAL_CS" not in text else ()


def _local_frame(chunk: Element, markers: Element) -> LocalFrame | None:
    """Return the frame at the first marker, where the chunk has longitudes and latitudes; None elsewhere."""
    reference = chunk.find("reference") or markers.find("reference")
    if reference is None or not reference.text.strip().startswith(("GEOGCS", "GEOGCRS")):
        return None
    references = (marker.find("reference") for marker in _grouped(markers, "markers", "marker"))
    first = next(
        (reference for reference in references if reference is not None and "x" in reference.attributes), None
    )
    return None if first is None else LocalFrame(np.array([first.number(name) for name in "xyz"]))


def _in_frame(network: Network, frame: LocalFrame) -> Network:
    """Return a network whose control points, given by longitude, latitude and height, are in a local frame."""
    control = tuple(replace(one, place=frame.place(one.place)) for one in network.control)
    start = network.start.copy()
    for gcp in control:
        start[gcp.point] = gcp.place
    return replace(network, control=control, start=start)


def _grouped(chunk: Element, outer: str, inner: str) -> list[Element]:
    return [*chunk.all(outer, inner), *chunk.all(outer, "group", inner)]


def _value(calibration: Element, name: str) -> float:
    element = calibration.find(name)
    return 0.0 if element is None else element.numbers(1)[0]


def _camera(sensor: Element) -> Camera:
    name = sensor.attributes.get("label") or sensor.attribute("id")
    kind = sensor.attributes.get("type", "frame")
    if kind != "frame":
        raise sensor.fail(f"sensor {name} is {kind!r}", "central projections ('frame') can be read")
    calibrations = list(sensor.all("calibration"))
    if not calibrations:
        raise sensor.fail(f"sensor {name} has no calibration", "align the photographs before exporting")
    calibration = next((c for c in calibrations if c.attributes.get("class") == "adjusted"), calibrations[-1])
    size = calibration.find("resolution") or sensor.need("resolution")
    width, height = int(size.number("width")), int(size.number("height"))
    fx, fy = (
        (_value(calibration, "f"),) * 2
        if calibration.find("f") is not None
        else (_value(calibration, "fx"), _value(calibration, "fy"))
    )
    if not (fx > 0.0 and fy > 0.0):
        raise calibration.fail(f"sensor {name} has no focal length", "align the photographs before exporting")
    if _value(calibration, "k4") or _value(calibration, "p3") or _value(calibration, "p4"):
        raise calibration.fail(f"sensor {name} has k4, p3 or p4", "calibrate with k1, k2, k3, p1, p2 alone")
    cx, cy = _value(calibration, "cx"), _value(calibration, "cy")
    if calibration.find("f") is not None:  # since version 1.4 the principal point counts from the centre
        cx, cy = cx + 0.5 * width, cy + 0.5 * height
    stretch = fx + _value(calibration, "b1")
    skew = _value(calibration, "b2") + _value(calibration, "skew")
    k1, k2, k3 = (_value(calibration, name) for name in ("k1", "k2", "k3"))
    inner = [
        fy,
        cx,
        cy,
        stretch / fy - 1.0,
        -skew / fy,
        k1 / fy**2,
        k2 / fy**4,
        k3 / fy**6,
        _value(calibration, "p1") / fy,
        -_value(calibration, "p2") / fy,
    ]
    return Camera(name, np.array(inner), (width, height), 1.0, "px", True, where=calibration.where)


def _is_enabled(element: Element) -> bool:
    return element.attributes.get("enabled", "true").lower() not in ("0", "false")


def _worlds(chunk: Element) -> dict[str, tuple[Array, Array, float]]:
    """Return rotation, shift and scale from each component to the world, "" for photographs of none.

    Since version 2.0 a chunk has components, each with a transform of its own.
    """
    components = {
        component.attribute("id"): component.find("transform")
        for component in chunk.all("components", "component")
    }
    outer = chunk.find("components")
    active = components.get("" if outer is None else outer.attributes.get("active_id", ""))
    default = chunk.find("transform") or active
    worlds = {number: _world(component or default) for number, component in components.items()}
    return worlds | {"": _world(default)}


def _world(transform: Element | None) -> tuple[Array, Array, float]:
    if transform is None:
        return np.eye(3), np.zeros(3), 1.0
    rotation, shift, scale = (
        transform.find("rotation"),
        transform.find("translation"),
        transform.find("scale"),
    )
    return (
        np.eye(3) if rotation is None else np.array(rotation.numbers(9)).reshape(3, 3),
        np.zeros(3) if shift is None else np.array(shift.numbers(3)),
        1.0 if scale is None else scale.numbers(1)[0],
    )


def _photo(element: Element, camera: int, world: tuple[Array, Array, float]) -> Photo:
    name = element.attributes.get("label") or element.attribute("id")
    rotation, station = None, None
    if (transform := element.find("transform")) is not None:
        pose = np.array(transform.numbers(16)).reshape(4, 4)
        turn, shift, scale = world
        rotation = turn @ pose[:3, :3] @ _FLIP
        if not np.allclose(rotation.T @ rotation, np.eye(3), atol=1e-6) or np.linalg.det(rotation) < 0.0:
            raise transform.fail(f"the transform of camera {name} is no rotation", "export the cameras again")
        station = scale * turn @ pose[:3, 3] + shift
    return Photo(name, camera, rotation, station, where=element.where)


def _network(
    path: Path,
    chunk: Element,
    cameras: tuple[Camera, ...],
    photos: dict[str, Photo],
    sigma: float,
    remarks: tuple[str, ...],
) -> Network:
    places = {photo: k for k, photo in enumerate(photos)}
    markers = {marker.attribute("id"): marker for marker in _grouped(chunk, "markers", "marker")}
    names = [marker.attributes.get("label") or number for number, marker in markers.items()]
    index = {number: k for k, number in enumerate(markers)}
    sigma = _setting(chunk, "accuracy_projections") or sigma
    common = _setting(chunk, "accuracy_markers")
    control = tuple(
        Control(
            index[number],
            place,
            covariance,
            check=reference.attributes.get("enabled", "true").lower() in ("0", "false"),
            where=reference.where,
        )
        for number, marker in markers.items()
        if (reference := marker.find("reference")) is not None and "x" in reference.attributes
        for place, covariance in [_reference(reference, common)]
    )
    photo, point, image, lines, seen = (
        list[int](),
        list[int](),
        list[list[float]](),
        list[int](),
        set[tuple[int, int]](),
    )
    for marker in chunk.all("frames", "frame", "markers", "marker"):
        number = marker.attribute("marker_id")
        if number not in index:
            raise marker.fail(f"marker {number} is not in the file", "export the markers again")
        for location in marker.all("location"):
            if location.attribute("camera_id") not in places or location.attributes.get(
                "pinned", "true"
            ).lower() in ("0", "false"):
                continue
            key = places[location.attributes["camera_id"]], index[number]
            if key in seen:
                raise location.fail(f"marker {names[key[1]]} is marked twice on one photograph", "keep one")
            seen.add(key)
            photo.append(key[0])
            point.append(key[1])
            image.append([location.number("x"), location.number("y")])
            lines.append(int(location.where.rpartition(":")[2]))
    start = np.full((len(names), 3), np.nan)
    for gcp in control:
        start[gcp.point] = gcp.place
    return marked_well(
        Network(
            str(path),
            cameras,
            tuple(photos.values()),
            tuple(names),
            start,
            control,
            np.array(photo, dtype=np.int64),
            np.array(point, dtype=np.int64),
            np.array(image).reshape(-1, 2),
            np.full((len(photo), 2), sigma),
            np.array(lines, dtype=np.int64),
            remarks,
        )
    )


def _setting(chunk: Element, name: str) -> float | None:
    """Return an accuracy that the chunk states for all that have none of their own."""
    setting = next((e for e in chunk.all("settings", "property") if e.attributes.get("name") == name), None)
    return None if setting is None else setting.number("value")


def _reference(reference: Element, common: float | None) -> tuple[Array, Array]:
    """Return the place of a marker by survey, and its covariance, by the accuracy of the chunk if it has none."""
    sigmas = [
        reference.attributes.get(name) or reference.attributes.get("sxyz") for name in ("sx", "sy", "sz")
    ]
    deviations = [
        common or 0.0 if text is None else parse_number(text, "a deviation", reference.where)
        for text in sigmas
    ]
    return np.array([reference.number(name) for name in "xyz"]), np.diag(np.square(deviations))


def write_metashape(network: Network, path: Path) -> None:
    """Write cameras and markers in one file, with all digits.

    Raises
    ------
    SurveyError
        if a camera has backward distortion, or an orientation is missing
    """
    out = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<document version="1.5.0">',
        '<chunk label="moma" enabled="true">',
        "<sensors>",
    ]
    for index, camera in enumerate(network.cameras):
        if not camera.forward:
            raise SurveyError(
                f"camera {camera.name} has backward distortion",
                where=str(path),
                remedy='Metashape holds forward distortion: calibrate with model = "forward"',
            )
        out += _sensor(index, camera)
    out += ["</sensors>", "<cameras>"]
    for index, photo in enumerate(network.photos):
        if photo.rotation is None or photo.station is None:
            raise SurveyError(
                f"photograph {photo.name} is not oriented", where=str(path), remedy="orient it first"
            )
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = photo.rotation @ _FLIP, photo.station
        numbers = " ".join(map(repr, pose.ravel().tolist()))
        out.append(
            f'<camera id="{index}" sensor_id="{photo.camera}" label={quoteattr(photo.name)} enabled="true">'
        )
        out += [f"<transform>{numbers}</transform>", "</camera>"]
    out += ["</cameras>", "<markers>"]
    control = {gcp.point: gcp for gcp in network.control}
    for number, name in enumerate(network.names):
        out.append(f'<marker id="{number}" label={quoteattr(name)}>')
        if number in control:
            x, y, z = control[number].place.tolist()
            deviations = np.sqrt(np.diag(control[number].covariance)).tolist()
            accuracy = (
                "".join(f' s{axis}="{value!r}"' for axis, value in zip("xyz", deviations, strict=True))
                if any(deviations)
                else ""
            )
            used = "false" if control[number].check else "true"
            out.append(f'<reference x="{x!r}" y="{y!r}" z="{z!r}"{accuracy} enabled="{used}"/>')
        out.append("</marker>")
    out += ["</markers>", "<frames>", '<frame id="0">', "<markers>"]
    of_point = marks_of_points(network)
    for i in range(len(network.names)):
        out.append(f'<marker marker_id="{i}">')
        for k in of_point[i]:
            x, y = network.image[k].tolist()
            out.append(f'<location camera_id="{network.photo[k]}" pinned="true" x="{x!r}" y="{y!r}"/>')
        out.append("</marker>")
    sigma = float(np.sqrt((network.sigma**2).mean())) if len(network.sigma) else 1.0
    out += ["</markers>", "</frame>", "</frames>", "<settings>"]
    out += [
        f'<property name="accuracy_projections" value="{sigma!r}"/>',
        *("</settings>", "</chunk>", "</document>", ""),
    ]
    path.write_text("\n".join(out), encoding="utf-8", newline="\n")


def _sensor(number: int, camera: Camera) -> list[str]:
    c, xp, yp, a, s, k1, k2, k3, p1, p2 = camera.inner.tolist()
    width, height = camera.size
    f = c / camera.pixel
    values = {
        "f": f, "b1": a * f, "b2": -s * f,
        "cx": xp / camera.pixel - 0.5 * width, "cy": yp / camera.pixel - 0.5 * height,
        "k1": k1 * c**2, "k2": k2 * c**4, "k3": k3 * c**6, "p1": p1 * c, "p2": -p2 * c,
    }  # fmt: skip
    size = f'<resolution width="{width}" height="{height}"/>'
    return [
        f'<sensor id="{number}" label={quoteattr(camera.name)} type="frame">',
        size,
        '<calibration type="frame" class="adjusted">',
        size,
        *(f"<{name}>{value!r}</{name}>" for name, value in values.items()),
        "</calibration>",
        "</sensor>",
    ]
