"""Photographs of a scene by known cameras, rendered off screen by PyVista, with the distortion of their lenses."""

import sys
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechanics.arrays import Array, Ints
from pipelines.draw.offscreen.jobs import run_job
from survey.orientation.network import Camera
from survey.orientation.projection import corrected

_SAMPLES = 8  # of each pixel, against jagged edges
_NEAR_FAR = (0.2, 60.0)  # distances within which things are seen [m]
_QUALITY = 88  # of JPEG


@dataclass(frozen=True)
class PhotographedScene:
    """Coloured and textured quadrilaterals before the camera.

    Attributes
    ----------
    points : (n, 3) corners of the quadrilaterals [m]
    quads : (m, 4)
    colours : (m, 3) of those without a texture
    textured : (t, 4) quadrilaterals with the texture, as indices of `points`
    places : (n, 2) place of each point in the texture, across and up, between 0 and 1
    texture : (h, w, 3)
    """

    points: Array
    quads: Ints
    colours: NDArray[np.uint8]
    textured: Ints
    places: Array
    texture: NDArray[np.uint8]


def draw(scene: PhotographedScene, path: Path, job: dict[str, Any]) -> None:
    """Render one photograph as JPEG.

    Parameters
    ----------
    job : inner, size, pixel, forward of the camera; rotation and station; `reduced`: pixels of the camera along a pixel
        of the picture
    """
    from PIL import Image

    inner, size = tuple(job["inner"]), tuple(job["size"])
    width, height = _window(inner, size, job["pixel"], job["forward"], job["reduced"])
    ideal = _render(scene, job, width, height)
    columns, rows = _places(inner, size, job["pixel"], job["forward"], job["reduced"])
    pixels = _sampled(ideal, columns + 0.5 * width, rows + 0.5 * height)
    Image.fromarray(np.round(pixels).astype(np.uint8)).save(path, quality=_QUALITY, subsampling=0)


def _render(scene: PhotographedScene, job: dict[str, Any], width: int, height: int) -> NDArray[np.uint8]:
    """Return the ideal photograph, without distortion, centred on the principal point."""
    import pyvista

    plotter = pyvista.Plotter(off_screen=True, window_size=[width, height], lighting="none")
    plotter.set_background("#b9c7d6")
    for quads, look in (
        (scene.textured, {"texture": pyvista.Texture(np.ascontiguousarray(scene.texture))}),
        (scene.quads, {"scalars": "colour", "rgb": True}),
    ):
        mesh = pyvista.PolyData(scene.points, faces=np.column_stack([np.full(len(quads), 4), quads]).ravel())
        if "texture" in look:
            mesh.active_texture_coordinates = scene.places
        else:
            mesh.cell_data["colour"] = scene.colours
        plotter.add_mesh(mesh, lighting=False, show_scalar_bar=False, **look)
    plotter.enable_anti_aliasing("msaa", multi_samples=_SAMPLES)
    rotation, station = np.array(job["rotation"]), np.array(job["station"])
    reach = 0.5 * height * job["pixel"] * job["reduced"]
    plotter.camera.position = station
    plotter.camera.focal_point = station - rotation[:, 2]
    plotter.camera.up = rotation[:, 1]
    plotter.camera.view_angle = float(np.degrees(2.0 * np.arctan(reach / job["inner"][0])))
    plotter.camera.clipping_range = _NEAR_FAR
    pixels: NDArray[np.uint8] = plotter.screenshot(None, return_img=True)
    plotter.close()
    return pixels


@lru_cache(maxsize=1)
def _places(
    inner: tuple[float, ...], size: tuple[int, int], pixel: float, forward: bool, reduced: int
) -> tuple[Array, Array]:
    """Return where each pixel of the photograph lies on the ideal one, from its middle, right and down [pixels]."""
    camera = Camera("camera", np.array(inner), size, pixel, forward=forward)
    width, height = (side // reduced for side in size)
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    ideal = corrected(camera, reduced * np.column_stack([x.ravel(), y.ravel()])) / (pixel * reduced)
    return ideal[:, 0].reshape(height, width), -ideal[:, 1].reshape(height, width)


def _window(
    inner: tuple[float, ...], size: tuple[int, int], pixel: float, forward: bool, reduced: int
) -> tuple[int, int]:
    """Return width and height of an ideal photograph that holds the distorted one."""
    columns, rows = _places(inner, size, pixel, forward, reduced)
    return 2 * int(np.abs(columns).max() + 2.0), 2 * int(np.abs(rows).max() + 2.0)


def _sampled(pixels: NDArray[np.uint8], columns: Array, rows: Array) -> Array:
    """Sample a picture between the middles of its pixels."""
    columns, rows = columns - 0.5, rows - 0.5
    left, above = np.floor(columns).astype(int), np.floor(rows).astype(int)
    across, down = ((coordinate % 1.0).astype(np.float32)[..., None] for coordinate in (columns, rows))
    upper = (1.0 - across) * pixels[above, left] + across * pixels[above, left + 1]
    lower = (1.0 - across) * pixels[above + 1, left] + across * pixels[above + 1, left + 1]
    out: Array = (1.0 - down) * upper + down * lower
    return out


if __name__ == "__main__":
    sys.exit(run_job(PhotographedScene, draw))
