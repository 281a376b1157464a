"""Orthophotos under elevations: a picture of a wall, moved from its own plane to that of a facade."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ground.errors import SurveyError, UsageError
from pipelines.draw.elevations.sheet import project
from survey.clouds.wall import Wall, read_wall
from survey.clouds.world import PixelPlace, world_of
from survey.quality.facades import WIDEST, Facade

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MAX_PIXELS = 3000  # pixels of the longer side that are drawn: more than a sheet shows


@dataclass(frozen=True)
class Orthophoto:
    """A picture in the plane of a wall.

    Attributes
    ----------
    wall : frame of the plane
    places : from pixels to the plane
    pixels : (h, w) or (h, w, 3)
    """

    wall: Wall
    places: PixelPlace
    pixels: NDArray[Any]

    def shows(self, facade: Facade) -> bool:
        """Return whether the picture was taken of a facade, by the directions that both face."""
        return bool(self.wall.axes[2] @ facade.frame.axes[2] >= np.cos(np.radians(WIDEST)))

    def draw(self, axes: "Axes", facade: Facade) -> None:
        """Draw the picture in the coordinates of a facade's elevation."""
        from matplotlib.transforms import Affine2D

        # three pixels of the plane say where all go: the elevation is an affine map of it
        pixels = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        flat = self.places.place(pixels)
        o, a, b = project(self.wall.origin + flat @ self.wall.axes[:2], facade)
        move = Affine2D.from_values(*(a - o), *(b - o), *o)
        step = max(1, max(self.pixels.shape[:2]) // _MAX_PIXELS)
        height, width = self.pixels.shape[:2]
        axes.imshow(
            self.pixels[::step, ::step],
            cmap="gray",
            origin="upper",
            extent=(-0.5, width - 0.5, height - 0.5, -0.5),
            transform=move + axes.transData,
            zorder=0,
        )


def read_orthophoto(path: Path) -> Orthophoto:
    """Read an orthophoto with its world file and the frame of its wall, which has the same name and ends in .toml.

    Raises
    ------
    UsageError
        if there is no such picture, or nothing says where it lies
    SurveyError
        if it cannot be read
    """
    if not path.is_file():
        raise UsageError("no such file", where=str(path), remedy="name an orthophoto, as moma cloud draws it")
    from PIL import Image

    try:
        with Image.open(path) as picture:
            pixels = np.asarray(picture.convert("L" if picture.mode in ("L", "I;16", "I") else "RGB"))
    except (OSError, ValueError) as error:
        remedy = "save it as PNG, JPEG or TIFF"
        raise SurveyError(f"cannot be read as a picture: {error}", where=str(path), remedy=remedy) from error
    places, frame = world_of(path), path.with_suffix(".toml")
    if places is None:
        remedy = "put its world file beside it (.pgw), as moma cloud writes it"
        raise UsageError("nothing says where it lies in its plane", where=str(path), remedy=remedy)
    if not frame.is_file():
        remedy = f"put the frame of its wall beside it, {frame.name}, as moma cloud writes it"
        raise UsageError("nothing says where its plane stands", where=str(path), remedy=remedy)
    return Orthophoto(read_wall(str(frame)), places, pixels)
