"""What the figures of a survey report have in common: their sheet and their colours."""

import logging
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["FLAG", "INK", "PALE", "PLAIN", "new_sheet", "save_sheet"]

_DPI = 150
INK, PALE = "#222222", "#a9a59e"
FLAG, PLAIN = "#d55e00", "#0072b2"  # vermilion and blue of Okabe and Ito: told apart by everybody


def new_sheet(size: tuple[float, float]) -> "Figure":
    """An empty figure of so many inches, without a window."""
    # matplotlib tells on stderr that it builds its font cache, once per machine
    logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)
    from matplotlib.figure import Figure

    return Figure(figsize=size, layout="constrained")


def save_sheet(figure: "Figure", path: Path) -> None:
    """Write a figure as PNG."""
    with warnings.catch_warnings():
        warnings.filterwarnings(
            "ignore", "Glyph"
        )  # codes in scripts that the font does not have show as boxes
        figure.savefig(path, dpi=_DPI)
