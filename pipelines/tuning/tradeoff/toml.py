"""A setting as lines of a scene file."""

from typing import Any

from pipelines.tuning.overlay import Overlay

__all__ = ["scene_lines"]


def scene_lines(overlay: Overlay, width: float) -> str:
    """TOML that makes a scene what an overlay makes of it; "" if that changes nothing.

    Parameters
    ----------
    overlay : the setting
    width : typical smallest width of the stones, to which its cells refer [m]
    """
    size = None if overlay.cells is None else width / overlay.cells
    tables: dict[str, dict[str, Any]] = {
        "bodies": {"default": overlay.fidelity},
        "mesh": {"element": overlay.element, "size": size},
        "contact": {"points": overlay.points, "placement": overlay.placement},
        "time": {"step": overlay.step, "theta": overlay.theta},
        "solver": {
            "method": overlay.method,
            "tolerance": overlay.tolerance,
            "velocity_tolerance": overlay.velocity_tolerance,
            "max_iterations": overlay.max_iterations,
        },
    }
    parts = []
    for table, keys in tables.items():
        lines = [f"{key} = {_written(value)}" for key, value in keys.items() if value is not None]
        if lines:
            parts.append("\n".join([f"[{table}]", *lines]))
    return "\n\n".join(parts)


def _written(value: Any) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    # repr has the point or exponent that TOML wants in a number that is not whole
    return repr(value) if isinstance(value, int) else repr(float(f"{value:.6g}"))
