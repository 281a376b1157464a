"""Fitness of a picture for outlines: what is too small, blurred, tilted, or no wall at all."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ground.statistics.scale import deviation
from survey.arrays import Array
from survey.clouds.pictures.channels import lightness
from survey.conventions import CERTAIN, CHECKED, LEVEL, MOST

_SMALLEST = 96  # pixels of the shorter side: fewer hold no two courses whose joints are three pixels wide
_FAINT = 0.35  # contrast of joints over grain below which none stands out
_TILTED = math.degrees(
    LEVEL
)  # angle of the beds from level [degrees]: a surveyed wall leans less, its beds sag less
_CONVERGING = 3.0  # change of the direction of beds or head joints over the picture [degrees]
_MIN_STONES = CHECKED  # stones from which a wall can be judged
_UNSURE = MOST  # mean score below which stones are more likely false
_SOFT = 0.44  # detail of a pixel over that of two at an edge blurred by two pixels; at a sharp edge 1.2
_ROUNDED = 0.113  # standard deviation of L* that rounding to 8 bits makes: 100 / 255 / √12


@dataclass(frozen=True)
class Findings:
    """Doubts about a picture.

    Attributes
    ----------
    refused : whether nothing is proposed
    texts : what is wrong, and the remedy
    contrast : of joints over grain
    """

    refused: bool
    texts: tuple[str, ...]
    contrast: float


def judge_picture(pixels: NDArray[np.uint8], joint: float, contrast: float) -> Findings:
    """Judge a picture before stones are looked for.

    Parameters
    ----------
    pixels : (h, w, 3)
    joint : width of its joints [px]
    contrast : of joints over grain
    """
    height, width = pixels.shape[:2]
    if min(height, width) < _SMALLEST:
        text = f"it is tiny: {width} × {height} pixels; take one of {_SMALLEST} or more a side"
        return Findings(True, (text,), contrast)
    texts = []
    soft = _detail(pixels) < _SOFT
    if contrast < _FAINT:
        cause = "it is blurred" if soft else "no joints stand out of its grain: it may show no wall"
        remedy = (
            "take a sharper picture"
            if soft
            else "crop it to the wall, or give the width of the joints with --joint"
        )
        return Findings(
            True,
            (f"{cause} (contrast of joints {contrast:.2f} of the grain, {_FAINT} is needed); {remedy}",),
            contrast,
        )
    if soft:
        texts.append(
            f"it is blurred: edges are wider than pixels, joints {joint:.0f} pixels; corners are less sure"
        )
    return Findings(False, tuple(texts), contrast)


def _detail(pixels: NDArray[np.uint8]) -> float:
    """Return the detail of single pixels over that of two, in the middle of a picture, without that of rounding.

    It is what Gaussian filters of one and two pixels take away. However blurred a picture is, a third remains.
    """
    from scipy.ndimage import gaussian_filter

    height, width = pixels.shape[:2]
    light = lightness(pixels[height // 4 : height // 4 + 600, width // 4 : width // 4 + 600])[0]
    impulse = np.zeros_like(light)
    impulse[tuple(np.array(light.shape) // 2)] = _ROUNDED * np.sqrt(light.size)  # of the variance of noise
    variances = []
    for image in (light, impulse):
        once, twice = gaussian_filter(image, 1.0), gaussian_filter(image, 2.0)
        variances.append([float(((image - once) ** 2).mean()), float(((once - twice) ** 2).mean())])
    fine, coarse = (seen - rounded for seen, rounded in zip(*variances, strict=True))
    return float(np.sqrt(max(fine, 0.0) / max(coarse, 1e-12)))


def judge_result(
    findings: Findings, rings: Sequence[Array], scores: Sequence[float], coursed: bool
) -> Findings:
    """Judge the stones that were found.

    Parameters
    ----------
    findings : of the picture
    rings : (n, 2) outlines in the wall's plane
    scores : of the stones
    coursed : whether the wall has courses
    """
    if findings.refused:
        return findings
    if len(rings) < _MIN_STONES or float(np.mean(scores)) < _UNSURE:
        text = f"hardly any stone is sure ({len(rings)} regions): it may show no wall; crop it, or choose --masonry"
        return replace(findings, refused=True, texts=(*findings.texts, text))
    if not coursed:
        return findings
    texts = list(findings.texts)
    refused = False
    for name, upright in (("beds", False), ("head joints", True)):
        tilt, change = _directions(rings, upright)
        if change > _CONVERGING:
            texts.append(
                f"it is not rectified: the direction of {name} changes by {change:.0f}° over it; rectify it first"
            )
            refused = True
        elif abs(tilt) > _TILTED:
            texts.append(f"it is tilted: {name} lean by {tilt:.1f}°; turn or rectify it first")
            refused = refused or abs(tilt) > 2.0 * _TILTED
    return replace(findings, refused=refused, texts=tuple(texts))


def _directions(rings: Sequence[Array], upright: bool) -> tuple[float, float]:
    """Return the angle of level or upright sides from it, and its change over the picture [degrees]."""
    ends = np.concatenate([np.column_stack([ring, np.roll(ring, -1, axis=0)]) for ring in rings])
    side = ends[:, 2:] - ends[:, :2]
    if upright:
        side = np.column_stack([side[:, 1], -side[:, 0]])
    angle = np.degrees(np.arctan2(side[:, 1], side[:, 0]))
    angle = (angle + 90.0) % 180.0 - 90.0
    weight = np.linalg.norm(side, axis=1)
    aligned = np.abs(angle) < 25.0
    if np.count_nonzero(aligned) < 8:
        return 0.0, 0.0
    use = aligned & (weight > 0.5 * np.median(weight[aligned]))  # no bevels
    middle = 0.5 * (ends[use, :2] + ends[use, 2:])
    span = np.ptp(middle, axis=0)
    terms = np.column_stack([np.ones(use.sum()), (middle - middle.mean(axis=0)) / np.maximum(span, 1e-9)])
    angles = np.zeros(3)
    scale = np.sqrt(weight[use])
    for _ in range(10):  # least absolute deviations: sides of arches and repairs have other directions
        angles = np.linalg.lstsq(terms * scale[:, None], angle[use] * scale, rcond=None)[0]
        scale = np.sqrt(weight[use] / np.maximum(np.abs(angle[use] - terms @ angles), 0.2))
    spread = deviation(angle[use] - terms @ angles, 0.0)
    share = weight[use] / weight[use].mean()
    error = spread * np.sqrt(np.diag(np.linalg.pinv((terms * share[:, None]).T @ terms)))
    change = np.where(np.abs(angles) > CERTAIN * error, np.abs(angles), 0.0)
    return float(angles[0]), float(change[1:].max())
