"""Outlines proposed from pictures beside true ones: `python -m benchmarks.outlines [--walls N] [--photographs DIR] …`.

Rendered walls have a truth of their own. Photographs come with boxes of some of their stones (boxes.json),
masks of rubble are
rendered in grey with noise; both are skipped where their folder is absent. With `--fit`, the weights of
borders are fitted to rendered walls and printed.
"""

import json
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.outlines_fit import fitted
from benchmarks.report import ROOT, Row, columns, options_of, progress, show
from survey.arrays import Array, Ints
from survey.clouds.pictures.photograph import Photograph
from survey.clouds.pictures.proposal import Proposal, propose_outlines
from survey.clouds.world import PixelPlace
from synthetic.buildings.rendered_walls import STYLES, RenderedWall, rasterised, render_wall

_SHARED = ROOT.parent / "shared" / "data"
_WEIGHTS = ROOT / "survey" / "clouds" / "pictures" / "weights.json"
_PIXEL = 0.002  # of the masks of rubble, which are 1.0 × 1.2 m [m]
_MATCHED = 3.0  # pixels of the work within which a corner belongs to a true one
_WALLS = columns(
    "wall wall | draws draws :d | quality panoptic quality :.3f | least least :.3f | corners corners, mm :.1f | "
    "z z :.2f | openings openings not stones :d | sure sure borders right, % :.0f | cpu_s CPU s :.3g"
)
_PHOTOGRAPHS = columns(
    "photograph photograph | boxes boxes :d | found found :d | overlap overlap :.3f | split split :d"
)


def picture_of(pixels: NDArray[np.uint8], pixel: float) -> Photograph:
    """Return a picture whose lower left corner is the origin, with pixels of a size [m]."""
    places = PixelPlace(np.diag([pixel, -pixel]), np.array([0.5 * pixel, (len(pixels) - 0.5) * pixel]))
    return Photograph(Path("wall.png"), pixels, None, None, places, True)


def panoptic_quality(found: Ints, true: Ints) -> float:
    """Return the panoptic quality of Kirillov et al. (2019) of numbered pixels (h, w), 0 being no stone."""
    rows, count = int(found.max()) + 1, int(true.max()) + 1
    shared = (
        np.bincount((found * count + true).ravel(), minlength=rows * count).reshape(rows, count).astype(float)
    )
    union = shared.sum(axis=1, keepdims=True) + shared.sum(axis=0, keepdims=True) - shared
    over = (shared / np.maximum(union, 1.0))[1:, 1:]
    return float(over[over > 0.5].sum() / max(0.5 * (rows - 1) + 0.5 * (count - 1), 1e-9))


def corner_errors(proposal: Proposal, wall: RenderedWall) -> Array:
    """Return errors (n, 4) of corners along x and y [m], and the same over their standard deviation."""
    size = np.array(wall.picture.shape[1::-1]) * wall.pixel
    true = np.concatenate([ring for ring in wall.outlines if len(ring) == 4])
    inner = ((true > 3.0 * wall.pixel) & (true < size - 3.0 * wall.pixel)).all(axis=1)
    true = true[inner]
    out = []
    for one in proposal.stones:
        if len(one.ring) != 4 or one.cut:
            continue
        for corner in one.ring:
            apart = true - corner
            nearest = apart[np.argmin((apart**2).sum(axis=1))]
            if float(np.hypot(*nearest)) < _MATCHED * proposal.joint[1]:
                out.append([*nearest, *(nearest / one.sigma)])
    return np.array(out).reshape(-1, 4)


def _right_borders(proposal: Proposal, wall: RenderedWall) -> list[tuple[float, bool]]:
    """Return the probability of each border, and whether it is between two true stones."""
    shape = wall.picture.shape[:2]
    true = rasterised(wall.outlines, shape, wall.pixel)
    found = rasterised([one.ring for one in proposal.stones], shape, wall.pixel)
    rows, count = int(found.max()) + 1, int(true.max()) + 1
    shared = np.bincount((found * count + true).ravel(), minlength=rows * count).reshape(rows, count)
    shared[:, 0] = 0
    main_ = shared.argmax(axis=1)
    return [
        (one.probability, bool(main_[one.stones[0] + 1] != main_[one.stones[1] + 1]))
        for one in proposal.borders
    ]


def _walls(draws: int, first: int) -> Iterator[Row]:
    """Yield a row for each kind of rendered wall."""
    for style in STYLES if draws else ():
        quality, errors, sure, open_, spent = [], [], [], 0, 0.0
        for seed in range(first, first + draws):
            progress(f"{style} {seed}")
            wall = render_wall(style, seed)
            began = time.process_time()
            proposal = propose_outlines(picture_of(wall.picture, wall.pixel))
            spent += time.process_time() - began
            shape = wall.picture.shape[:2]
            true = rasterised(wall.outlines, shape, wall.pixel)
            found = rasterised([one.ring for one in proposal.stones], shape, wall.pixel)
            quality.append(panoptic_quality(found, true))
            errors.append(corner_errors(proposal, wall))
            sure += [right for chance, right in _right_borders(proposal, wall) if 0.85 <= chance < 0.95]
            if wall.opening is not None:
                inside = rasterised([wall.opening], shape, wall.pixel) > 0
                open_ += float((found[inside] > 0).mean()) < 0.05
        every = np.concatenate(errors)
        yield {
            "wall": style,
            "draws": draws,
            "quality": float(np.mean(quality)),
            "least": float(np.min(quality)),
            "corners": float(1e3 * np.sqrt((every[:, :2] ** 2).sum(axis=1).mean())) if len(every) else None,
            "z": float(np.sqrt((every[:, 2:] ** 2).mean())) if len(every) else None,
            "openings": open_,
            "sure": 100.0 * float(np.mean(sure)) if sure else None,
            "cpu_s": spent / draws,
        }


def _photographs(folder: Path) -> Iterator[Row]:
    """Yield a row for each photograph with boxes, and one for all."""
    from PIL import Image

    every: list[tuple[float, bool]] = []
    for name, boxes in json.loads((folder / "boxes.json").read_text(encoding="utf-8")).items():
        progress(name)
        with Image.open(folder / name) as picture:
            pixels = np.asarray(picture.convert("RGB"))
        proposal = propose_outlines(picture_of(pixels, 1.0))
        found = rasterised([one.ring for one in proposal.stones], pixels.shape[:2], 1.0)
        over = [_overlap(found, box) for box in boxes]
        every += over
        yield _row(name, over)
    yield _row("all", every)


def _row(name: str, over: list[tuple[float, bool]]) -> Row:
    values = np.array([one for one, _ in over])
    return {
        "photograph": name,
        "boxes": len(over),
        "found": int((values > 0.5).sum()),
        "overlap": float(np.median(values)),
        "split": sum(split for _, split in over),
    }


def _overlap(found: Ints, box: tuple[int, int, int, int]) -> tuple[float, bool]:
    """Return the overlap of a box with the stone that fills most of it, and whether a second fills a tenth of it."""
    x0, y0, x1, y1 = box
    numbers, counts = np.unique(found[y0:y1, x0:x1], return_counts=True)
    counts = counts[numbers > 0]
    numbers = numbers[numbers > 0]
    if not len(numbers):
        return 0.0, False
    size, area = (x1 - x0) * (y1 - y0), int((found == numbers[counts.argmax()]).sum())
    return float(counts.max() / (size + area - counts.max())), bool((counts > 0.1 * size).sum() > 1)


def _masks(folder: Path) -> Iterator[Row]:
    """Yield a row for each mask of rubble, rendered in grey with noise."""
    from PIL import Image
    from scipy.ndimage import gaussian_filter, label

    for path in sorted(folder.glob("*.png")):
        progress(path.name)
        with Image.open(path) as picture:
            shape = round(1.2 / _PIXEL), round(1.0 / _PIXEL)
            white = np.asarray(picture.convert("L").resize(shape[::-1], Image.Resampling.BOX)) > 127
        true, count = label(white)
        chance = np.random.default_rng(7)
        grey = np.where(white, chance.normal(165.0, 8.0, count + 1)[true], 120.0)
        grey = gaussian_filter(grey, 0.7) + chance.normal(0.0, 6.0, shape)
        pixels = np.repeat(np.clip(grey, 0, 255).astype(np.uint8)[..., None], 3, axis=2)
        began = time.process_time()
        proposal = propose_outlines(picture_of(pixels, _PIXEL))
        spent = time.process_time() - began
        found = rasterised([one.ring for one in proposal.stones], shape, _PIXEL)
        quality = panoptic_quality(found, true.astype(np.int64))
        yield {"wall": path.stem, "draws": 1, "quality": quality, "least": quality, "cpu_s": spent}


def main() -> None:
    """Run the benchmark."""
    options = options_of("outlines", __doc__)
    options.add_argument("--walls", type=int, default=3, help="draws of each kind of rendered wall")
    options.add_argument(
        "--first", type=int, default=100, help="seed of the first; weights were fitted to 0 to 2"
    )
    options.add_argument(
        "--photographs", type=Path, default=_SHARED / "segmentation", help="folder with boxes.json"
    )
    options.add_argument(
        "--masks", type=Path, default=_SHARED / "experiments" / "masks", help="folder of masks"
    )
    options.add_argument(
        "--fit",
        type=int,
        metavar="N",
        help="fit the weights of survey/clouds/pictures to N draws of each kind instead",
    )
    given = options.parse_args()
    if given.fit:
        rounded = {name: [round(float(one), 2) for one in weights] for name, weights in fitted(given.fit)}
        lines = ",\n ".join(f"{json.dumps(name)}: {weights}" for name, weights in rounded.items())
        _WEIGHTS.write_text(f"{{\n {lines}\n}}\n", encoding="utf-8")
        return
    rows = list(_photographs(given.photographs)) if (given.photographs / "boxes.json").is_file() else []
    rows += _masks(given.masks) if given.masks.is_dir() else []
    rows += _walls(given.walls, given.first)
    show(rows, _PHOTOGRAPHS, _WALLS, as_json=given.json)


if __name__ == "__main__":
    main()
