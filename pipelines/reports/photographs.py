"""The page of oriented photographs, by itself and as a part of the survey report."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from pipelines.draw.photographs import draw_network, draw_photo_residuals
from pipelines.reports.html import MAX_ROWS, picture, residual_cells, table_of, write_page

Row = tuple[str, ...]


def draw_photographs(
    values: Mapping[str, Any], folder: Path, pictures: Mapping[str, Path], prefix: str = ""
) -> dict[str, str]:
    """Draw the pictures into a folder; return captions by file name.

    Parameters
    ----------
    values : of `orientation_values`
    pictures : files of the photographs themselves, by their names
    prefix : of the names of the files
    """
    network, residuals = f"{prefix}network.png", f"{prefix}photo-residuals.png"
    larger = draw_network(folder / network, values)
    count, factor = draw_photo_residuals(folder / residuals, values, pictures)
    which = (
        "each photograph" if count == len(values["photos"]) else f"the {count} photographs with the largest"
    )
    return {
        network: f"The network from above and from the side: stations, rays, points, ellipses {larger:g} times "
        "enlarged.",
        residuals: f"Residuals of the marks on {which}, {factor:g} times enlarged; orange: suspected or left out.",
    }


def write_photographs_page(
    path: Path, values: Mapping[str, Any], pictures: Mapping[str, str], version: str
) -> None:
    """Write the page and embed the pictures of its folder."""
    redundancy = values["redundancy"]
    lead = (
        f"{len(values['photos'])} photographs, {len(values['points'])} points, {len(values['marks']['x'])} marks: "
        + (
            f"σ₀ {values['sigma0']:.4g} with redundancy {redundancy}."
            if redundancy > 0
            else "nothing checks the marks."
        )
    )
    write_page(
        path,
        "photographs.html",
        name=values["name"],
        lead=lead,
        warnings=values["remarks"],
        photographs=photographs_section(values, pictures, path.parent),
        version=version,
    )


def photographs_section(
    values: Mapping[str, Any], pictures: Mapping[str, str], folder: Path
) -> dict[str, Any]:
    """Describe the photographs for a template."""
    marks = values["marks"]
    suspected = sorted(
        (k for k, verdict in enumerate(marks["verdict"]) if verdict), key=lambda k: -(marks["test"][k] or 0.0)
    )
    return {
        "pictures": [picture(folder / name, caption) for name, caption in pictures.items()],
        "adjustment": _adjustment(values),
        "cameras": [_camera(camera) for camera in values["cameras"]],
        "photos": table_of("photographs", values["photos"], _photo, MAX_ROWS),
        "control": table_of("control of photographs", values["control"], _control, MAX_ROWS),
        "suspected": table_of("suspected marks", suspected, partial(_mark, marks), MAX_ROWS),
        "correlations": table_of("correlations", values["correlations"], _correlation, MAX_ROWS),
    }


def _adjustment(values: Mapping[str, Any]) -> list[Row]:
    marks = values["marks"]
    external = [
        mark
        for mark, verdict in zip(marks["external"], marks["verdict"], strict=True)
        if mark is not None and not verdict
    ]
    unchecked = sum(one is None for one in marks["external"])
    return [
        ("Observations", str(values["observations"])),
        ("Unknowns", str(values["unknowns"])),
        ("Redundancy", str(values["redundancy"])),
        ("σ₀: found over stated", "–" if values["sigma0"] is None else f"{values['sigma0']:.4g}"),
        ("Datum", values["datum"]),
        ("Iterations", str(values["iterations"])),
        (
            "Movement of a point by a blunder that just escapes",
            f"up to {max(external) * 1e3:.1f} mm" if external else "–",
        ),
        ("Marks that nothing checks", str(unchecked)),
    ]


def _camera(camera: Mapping[str, Any]) -> dict[str, Any]:
    rows = [
        {
            "parameter": name,
            "value": f"{value['value']:.8g}",
            "sigma": f"± {value['sigma']:.3g}" if value["sigma"] else "held",
        }
        for name, value in camera["parameters"].items()
    ]
    width, height = camera["size"]
    return {
        "name": f"{camera['name']}: {camera['model']} model, {width} × {height} pixels, {camera['unit']}",
        "rows": table_of("camera", rows, dict),
    }


def _photo(photo: Mapping[str, Any]) -> dict[str, str]:
    sigma = photo["sigma"]
    return {
        "photograph": photo["name"],
        **{name: f"{photo[name]:.4f} ± {sigma[name]:.4f}°" for name in ("omega", "phi", "kappa")},
        **{name: f"{photo[name]:.4f} ± {sigma[name]:.4f} m" for name in "xyz"},
        "marks": str(photo["marks"]),
        "rms": "–" if photo["rms"] is None else f"{photo['rms']:.2f} px",
    }


def _control(point: Mapping[str, Any]) -> dict[str, str]:
    return {
        "id": point["id"],
        "use": point["use"],
        **residual_cells(point["residual"]),
        "test": "–" if point["use"] == "fixed" else f"{point['test']:.2f}",
    }


def _correlation(correlation: Mapping[str, Any]) -> dict[str, str]:
    names = {name: str(correlation[name]) for name in ("of", "a", "b")}
    return names | {"value": f"{100.0 * correlation['value']:.1f} %"}


def _mark(marks: Mapping[str, Any], k: int) -> dict[str, str]:
    vx, vy, test = marks["vx"][k], marks["vy"][k], marks["test"][k]
    return {
        "photograph": marks["photo"][k],
        "point": marks["point"][k],
        "line": str(marks["line"][k]) if marks["line"][k] > 0 else "–",
        "residual": "–" if vx is None else f"{vx:z.2f}, {vy:z.2f} px",
        "test": "–" if test is None else f"{test:.1f} σ",
        "verdict": "left out" if marks["verdict"][k] == "removed" else "suspected",
    }
