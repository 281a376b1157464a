"""One scene at other settings: the changes that a profile, or a point of a tradeoff study, makes to it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechanics.arrays import Array
from mechanics.scene.scene import Block, Fidelity, Method, Placement, Scene
from mechanics.stones.meshing.elements import Element
from mechanics.stones.polyhedra import smallest_width
from pipelines.scene.file import SceneFile
from pipelines.scene.selection import StoneModel

_ENUMS: Mapping[str, Any] = {
    "fidelity": Fidelity,
    "element": Element,
    "placement": Placement,
    "method": Method,
}

# settings that replace those of the same name in a table of the scene
_TABLES: Mapping[str, tuple[str, ...]] = {
    "contact": ("points", "placement"),
    "time": ("step", "theta"),
    "solver": ("method", "tolerance", "velocity_tolerance", "motion_error", "max_iterations"),
}


@dataclass(frozen=True)
class Overlay:
    """Settings that replace those of a scene; None keeps the scene's own.

    Selection, materials, laws, loads and supports are the scene's own. Lists of stones in [bodies] take precedence
    over `fidelity`, as they do over its `default`.

    Attributes
    ----------
    fidelity : of stones that no list names
    element : type of finite element
    cells : their number along the typical (median) smallest width of the stones; replaces the size of the mesh, and
        `contact_size` [-]
    points, placement : contact points of two flat faces
    step, theta : of the time integration [s], [-]
    method, tolerance, velocity_tolerance, motion_error, max_iterations : of the solver
    """

    fidelity: Fidelity | None = None
    element: Element | None = None
    cells: float | None = None
    points: int | None = None
    placement: Placement | None = None
    step: float | None = None
    theta: float | None = None
    method: Method | None = None
    tolerance: float | None = None
    velocity_tolerance: float | None = None
    motion_error: float | None = None
    max_iterations: int | None = None


def overlaid(scene: SceneFile, overlay: Overlay, width: float) -> SceneFile:
    """Return the scene at the settings of the overlay; entries of [[meshes]] keep their own.

    Parameters
    ----------
    scene : as its author wrote it
    overlay : replaces its settings
    width : typical smallest width of its stones, to which `cells` refers [m]
    """
    # a scene's grading belongs to its own size
    sizes: dict[str, Any] = (
        {}
        if overlay.cells is None
        else {"size": width / overlay.cells, "contact_size": None, "ring_size": None}
    )
    return replace(
        scene,
        bodies=replace(scene.bodies, **_given({"default": overlay.fidelity})),
        mesh=replace(scene.mesh, **_given({"element": overlay.element}), **sizes),
        **_replaced(scene, overlay),
    )


def overlaid_scene(scene: Scene, overlay: Overlay, listed: frozenset[str] = frozenset()) -> Scene:
    """Return an assembled scene at the settings of the overlay; the blocks `listed` by code keep their fidelity."""
    size = None
    if overlay.cells is not None:
        size = _median_width((block.vertices, block.faces) for block in scene.blocks) / overlay.cells
    return replace(
        scene,
        blocks=tuple(_block(block, overlay, size, block.code in listed) for block in scene.blocks),
        **_replaced(scene, overlay),
    )


def overlay_record(overlay: Overlay) -> dict[str, Any]:
    """Return the settings of an overlay in plain texts and numbers."""
    return {name: str(value) if name in _ENUMS else value for name, value in _given(vars(overlay)).items()}


def overlay_from(record: Mapping[str, Any]) -> Overlay:
    """Read back what `overlay_record` returned."""
    return Overlay(
        **{name: _ENUMS[name](value) if name in _ENUMS else value for name, value in record.items()}
    )


def scene_lines(overlay: Overlay, width: float) -> str:
    """Return the TOML that turns a scene into the overlaid one; "" if that changes nothing.

    Parameters
    ----------
    overlay : the setting
    width : typical smallest width of the stones, to which its cells refer [m]

    >>> print(scene_lines(Overlay(element=Element.TET10, cells=2.0, tolerance=1e-4), width=0.3))
    [mesh]
    element = "tet10"
    size = 0.15
    <BLANKLINE>
    [solver]
    tolerance = 0.0001
    """
    size = None if overlay.cells is None else width / overlay.cells
    tables = {
        "bodies": _given({"default": overlay.fidelity}),
        "mesh": _given({"element": overlay.element, "size": size}),
        **_settings(overlay),
    }
    return "\n\n".join(
        "\n".join([f"[{table}]", *(f"{key} = {_toml(value)}" for key, value in keys.items())])
        for table, keys in tables.items()
        if keys
    )


def typical_width(models: Iterable[StoneModel]) -> float:
    """Return the median of the smallest widths of surveyed stones [m]."""
    return _median_width((model.record.solid_vertices, model.record.solid_faces) for model in models)


def _median_width(solids: Iterable[tuple[Array, tuple[tuple[int, ...], ...]]]) -> float:
    return float(np.median([smallest_width(vertices, faces) for vertices, faces in solids]))


def _block(block: Block, overlay: Overlay, size: float | None, listed: bool) -> Block:
    keeps = listed or block.fidelity is Fidelity.FIXED
    fidelity = block.fidelity if keeps or overlay.fidelity is None else overlay.fidelity
    if fidelity is not Fidelity.DEFORMABLE:
        return replace(block, fidelity=fidelity, mesh_size=None)
    mesh: dict[str, Any] = {} if size is None else {"mesh_size": size, "contact_size": None}
    return replace(block, fidelity=fidelity, **_given({"element": overlay.element}), **mesh)


def _replaced(scene: SceneFile | Scene, overlay: Overlay) -> dict[str, Any]:
    """Return contact, time and solver of a scene with what the overlay gives."""
    return {table: replace(getattr(scene, table), **fields) for table, fields in _settings(overlay).items()}


def _settings(overlay: Overlay) -> dict[str, dict[str, Any]]:
    """Return what the overlay gives of contact, time and solver."""
    return {
        table: _given({name: getattr(overlay, name) for name in names}) for table, names in _TABLES.items()
    }


def _given(values: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if value is not None}


def _toml(value: Any) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    # repr has the point or exponent that TOML requires in a number that is not whole
    return repr(value) if isinstance(value, int) else repr(float(f"{value:.6g}"))
