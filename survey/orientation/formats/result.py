"""orientation.json: the result of an orientation, for programs, reports, and the stones measured on its photographs.

Angles in degrees, places in metres, cameras in their unit, marks in pixels; deviations and covariances have σ₀² in
them.
"""

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np

from ground.errors import SurveyError
from ground.tables.numbers import unreadable
from survey.arrays import Array
from survey.conventions import FEW
from survey.orientation.bundle.control import control_tests
from survey.orientation.bundle.orient import Orientation
from survey.orientation.bundle.statistics import photo_precision
from survey.orientation.network import INTERIOR, Camera, Photo
from survey.orientation.oriented import Oriented
from survey.orientation.rotations import angles, from_angles

_CORRELATED = 1.0 - FEW  # correlation from which two parameters are named
_ANGLES = ("omega", "phi", "kappa", "x", "y", "z")


def orientation_values(result: Orientation, *, name: str = "") -> dict[str, Any]:
    """Describe an orientation in plain values.

    Returns
    -------
    dict
        sigma0, redundancy, observations, unknowns, iterations, camera, cameras, photos, points, control, marks,
        correlations, remarks, covariance (lower triangle by rows, little-endian float64 in base64) with its columns
    """
    network, statistics = result.network, result.statistics
    values = result.solution.unknowns
    scaled = result.scale**2
    deviations = result.scale * np.sqrt(np.maximum(np.diag(statistics.cameras), 0.0))
    column = {column: k for k, column in enumerate(result.prepared.columns)}
    cameras = [
        {
            "name": camera.name,
            "model": camera.model,
            "unit": camera.unit,
            "size": list(camera.size),
            "pixel": camera.pixel,
            "parameters": {
                parameter: {
                    "value": float(values.inner[m, k]),
                    "sigma": float(deviations[column[camera.name, parameter]])
                    if (camera.name, parameter) in column
                    else 0.0,
                }
                for k, parameter in enumerate(INTERIOR)
            },
        }
        for m, camera in enumerate(network.cameras)
    ]
    return {
        "name": name or network.path,
        "sigma0": _finite(statistics.sigma0),
        "redundancy": statistics.redundancy,
        "observations": result.prepared.observations,
        "unknowns": result.prepared.count,
        "iterations": result.solution.iterations,
        "datum": _datum(result),
        "scale": _source(result, "scale bars" if network.bars else None),
        "vertical": _source(result, "plumb lines" if network.plumb_lines else None),
        "lengths": _lengths(result),
        "left_out": dict(result.left_out),
        "camera": cameras[0]["parameters"],
        "cameras": cameras,
        "photos": _photos(result),
        "points": [
            {
                "id": network.names[i],
                "xyz": values.point[i].tolist(),
                "covariance": (scaled * statistics.points[i]).tolist(),
            }
            for i in range(len(network.names))
            if np.isfinite(statistics.points[i]).all() and np.isfinite(values.point[i]).all()
        ],
        "control": _control(result),
        "marks": _marks(result),
        "correlations": _correlations(result),
        "remarks": list(result.remarks),
        "covariance": {
            "columns": [list(column) for column in result.prepared.columns],
            "lower": _packed(scaled * statistics.cameras),
        },
        "mark_sigma": float(np.sqrt((network.sigma**2).mean())) * result.scale,
    }


def _datum(result: Orientation) -> str:
    if not result.prepared.datum:
        return "control"
    observed = [
        name
        for name, lines in (("scale bars", result.network.bars), ("plumb lines", result.network.plumb_lines))
        if lines
    ]
    rest = "inner constraints of the photographs" if observed else "inner constraints of the points"
    return ", ".join([*observed, rest])


def _source(result: Orientation, observed: str | None) -> str | None:
    """Return what scale or vertical come from; None if nothing tells them."""
    if not result.prepared.datum:
        return "control"
    return observed or ("start values" if result.network.start_datum else None)


def _lengths(result: Orientation) -> list[dict[str, Any]]:
    """Describe scale bars, and the points of plumb lines above the first in x and y."""
    network, statistics = result.network, result.statistics
    if statistics.lengths is None or statistics.length_tests is None:
        return []
    names = [("scale bar", bar.points, bar.sigma) for bar in network.bars]
    names += [
        (f"plumb line, {axis}", (line.points[0], top), line.sigma)
        for line in network.plumb_lines
        for top in line.points[1:]
        for axis in "xy"
    ]
    return [
        {
            "kind": kind,
            "points": [network.names[i] for i in points],
            "sigma": sigma,
            "residual": float(residual),
            "test": float(test),
        }
        for (kind, points, sigma), residual, test in zip(
            names, statistics.lengths, statistics.length_tests, strict=True
        )
    ]


def _photos(result: Orientation) -> list[dict[str, Any]]:
    network, values = result.network, result.solution.unknowns
    covariance = photo_precision(network, result.prepared, result.solution, result.statistics)
    deviations = result.scale * np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0.0))
    deviations[:, :3] = np.degrees(deviations[:, :3])
    residuals, out = result.residuals, []
    for f, photo in enumerate(network.photos):
        mine = residuals[(network.photo == f) & np.isfinite(residuals).all(axis=1)]
        place = [*np.degrees(angles(values.rotation[f])).tolist(), *values.station[f].tolist()]
        out.append(
            {
                "name": photo.name,
                "camera": network.cameras[photo.camera].name,
                **dict(zip(_ANGLES, place, strict=True)),
                "sigma": dict(zip(_ANGLES, deviations[f].tolist(), strict=True)),
                "marks": len(mine),
                "rms": float(np.sqrt((mine**2).sum(axis=1).mean())) if len(mine) else None,
            }
        )
    return out


def _control(result: Orientation) -> list[dict[str, Any]]:
    network, values = result.network, result.solution.unknowns
    tests = control_tests(network, result.solution, result.statistics)
    return [
        {
            "id": network.names[gcp.point],
            "use": "check" if gcp.check else "fixed" if gcp.fixed else "weighted",
            "place": gcp.place.tolist(),
            "sigma": np.sqrt(np.diag(gcp.covariance)).tolist(),
            "residual": (gcp.place - values.point[gcp.point]).tolist(),
            "test": float(test),
        }
        for gcp, test in zip(network.control, tests, strict=True)
    ]


def _marks(result: Orientation) -> dict[str, Any]:
    """Describe the marks by columns: rows of their own would make the file three times as long."""
    network, statistics = result.network, result.statistics
    removed = result.removed
    taken = [
        k for k in range(len(network.photo)) if np.isfinite(statistics.residuals[k]).all() or k in removed
    ]
    tests, residuals = np.abs(statistics.standardised), result.residuals
    suspected = set(result.suspected)
    return {
        "photo": [network.photos[network.photo[k]].name for k in taken],
        "point": [network.names[network.point[k]] for k in taken],
        "line": network.lines[taken].tolist(),
        "x": network.image[taken, 0].tolist(),
        "y": network.image[taken, 1].tolist(),
        "vx": [_finite(value) for value in residuals[taken, 0].round(5).tolist()],
        "vy": [_finite(value) for value in residuals[taken, 1].round(5).tolist()],
        "test": [
            removed.get(k, _finite(value))
            for k, value in zip(taken, tests[taken].max(axis=1).round(3).tolist(), strict=True)
        ],
        "redundancy": [_finite(value) for value in statistics.parts[taken].sum(axis=1).round(4).tolist()],
        "external": [_finite(value) for value in statistics.external[taken].max(axis=1).round(7).tolist()],
        "verdict": ["removed" if k in removed else "suspected" if k in suspected else "" for k in taken],
    }


def _correlations(result: Orientation) -> list[dict[str, Any]]:
    """Name pairs of parameters of one camera or photograph with a correlation over 95 %."""
    columns = result.prepared.columns
    size = np.sqrt(np.maximum(np.diag(result.statistics.cameras), 1e-300))
    labels = {"rx": "omega", "ry": "phi", "rz": "kappa"}
    precision = photo_precision(result.network, result.prepared, result.solution, result.statistics)
    out = []
    for f, photo in enumerate(result.network.photos):
        covariance = precision[f]
        spread = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
        for a in range(6):
            for b in range(a + 1, 6):
                value = float(covariance[a, b] / (spread[a] * spread[b]))
                if abs(value) > _CORRELATED and covariance.any():
                    out.append({"of": photo.name, "a": _ANGLES[a], "b": _ANGLES[b], "value": value})
    inner = [k for k, (_, parameter) in enumerate(columns) if parameter in INTERIOR]
    for place, a in enumerate(inner):
        for b in inner[place + 1 :]:
            value = float(result.statistics.cameras[a, b] / (size[a] * size[b]))
            if abs(value) > _CORRELATED and columns[a][0] == columns[b][0]:
                names = [labels.get(columns[k][1], columns[k][1]) for k in (a, b)]
                out.append({"of": columns[a][0], "a": names[0], "b": names[1], "value": value})
    return out


def _packed(matrix: Array) -> str:
    lower = matrix[np.tril_indices(len(matrix))]
    return base64.b64encode(lower.astype("<f8").tobytes()).decode("ascii")


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def write_orientation(path: Path, values: dict[str, Any]) -> None:
    """Write the file: a line for each value, each item of a list, and each column of the marks."""
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write("{")
        for number, (name, value) in enumerate(values.items()):
            file.write(f"{',' if number else ''}\n{_json(name)}: ")
            if isinstance(value, dict):
                file.write("{")
                for k, (key, entry) in enumerate(value.items()):
                    file.write(f"{',' if k else ''}\n {_json(key)}: {_json(entry)}")
                file.write("\n}" if value else "}")
            elif isinstance(value, list):
                file.write("[")
                for k, entry in enumerate(value):
                    file.write(f"{',' if k else ''}\n {_json(entry)}")
                file.write("\n]" if value else "]")
            else:
                file.write(_json(value))
        file.write("\n}\n")


def _json(value: object) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def read_orientation(path: Path) -> Oriented:
    """Read the photographs of such a file.

    Raises
    ------
    SurveyError
        if it cannot be read, or is not such a file
    """
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise unreadable(path, error, "write it with moma orient") from error
    except ValueError as error:
        raise SurveyError(
            f"this is not JSON: {error}", where=str(path), remedy="write it with moma orient"
        ) from error
    try:
        return _oriented(path, values)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise SurveyError(
            f"this is not the result of an orientation: {type(error).__name__} {error}",
            where=str(path),
            remedy="write it with moma orient",
        ) from error


def _oriented(path: Path, values: dict[str, Any]) -> Oriented:
    cameras = tuple(
        Camera(
            camera["name"],
            np.array([float(camera["parameters"][name]["value"]) for name in INTERIOR]),
            (int(camera["size"][0]), int(camera["size"][1])),
            float(camera["pixel"]),
            str(camera["unit"]),
            camera["model"] == "forward",
        )
        for camera in values["cameras"]
    )
    index = {camera.name: k for k, camera in enumerate(cameras)}
    photos = tuple(
        Photo(
            photo["name"],
            index[photo["camera"]],
            from_angles(*np.radians([photo["omega"], photo["phi"], photo["kappa"]])),
            np.array([photo["x"], photo["y"], photo["z"]], dtype=float),
        )
        for photo in values["photos"]
    )
    columns = [tuple(column) for column in values["covariance"]["columns"]]
    lower = np.frombuffer(base64.b64decode(values["covariance"]["lower"]), dtype="<f8")
    covariance = np.zeros((len(columns), len(columns)))
    covariance[np.tril_indices(len(columns))] = lower
    covariance += np.tril(covariance, -1).T
    place = {column: k for k, column in enumerate(columns)}
    exterior = ("rx", "ry", "rz", "x", "y", "z")
    table = np.array(
        [
            [place.get((photo.name, name), -1) for name in exterior]
            + [place.get((cameras[photo.camera].name, name), -1) for name in INTERIOR]
            for photo in photos
        ],
        dtype=np.int64,
    )
    controlled = values.get("datum") == "control"
    unknown = tuple(
        name for name in ("scale", "vertical") if not values.get(name, "control" if controlled else None)
    )
    return Oriented(
        str(path),
        cameras,
        photos,
        table,
        covariance,
        float(values["mark_sigma"]),
        unknown,
        dict(values.get("left_out", {})),
    )
