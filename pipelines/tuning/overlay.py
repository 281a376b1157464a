"""One scene at other settings: what a profile, or a point of a study of speed against accuracy, changes of it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechanics.scene.scene import Block, Fidelity, Method, Placement, Scene
from mechanics.stones.meshing.elements import Element
from mechanics.stones.polyhedra import smallest_width
from pipelines.arrays import Array
from pipelines.scene.file import SceneFile
from pipelines.scene.selection import StoneModel

__all__ = ["Overlay", "overlaid", "overlaid_scene", "typical_width"]


@dataclass(frozen=True)
class Overlay:
    """Settings that replace those of a scene; None leaves what the scene says.

    Selection, materials, laws, loads and supports are the scene's own. Lists of stones in [bodies] go before
    `fidelity`, as they go before its `default`.

    Attributes
    ----------
    fidelity : of stones that no list names
    element : kind of finite elements
    cells : their number along the typical (median) smallest width of the stones; stands for the size of the mesh, and
        for `contact_size` [-]
    points, placement : contact points of two flat faces
    step, theta : of the time integration [s], [-]
    method, tolerance, velocity_tolerance, max_iterations : of the solver
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
    max_iterations: int | None = None


def overlaid(scene: SceneFile, overlay: Overlay, width: float) -> SceneFile:
    """The scene at the settings of the overlay; entries of [[meshes]] keep their own.

    Parameters
    ----------
    scene : as its author wrote it
    overlay : what replaces its settings
    width : typical smallest width of its stones, to which `cells` refers [m]
    """
    # a scene's grading belongs to its own size
    sizes: dict[str, Any] = (
        {}
        if overlay.cells is None
        else {"size": width / overlay.cells, "contact_size": None, "ring_size": None}
    )
    contact, time, solver = _settings(overlay)
    return replace(
        scene,
        bodies=replace(scene.bodies, **_given({"default": overlay.fidelity})),
        mesh=replace(scene.mesh, **_given({"element": overlay.element}), **sizes),
        contact=replace(scene.contact, **contact),
        time=replace(scene.time, **time),
        solver=replace(scene.solver, **solver),
    )


def overlaid_scene(scene: Scene, overlay: Overlay, listed: frozenset[str] = frozenset()) -> Scene:
    """As `overlaid`, of a scene that has been assembled; `listed` are the codes of blocks that keep their fidelity."""
    size = None
    if overlay.cells is not None:
        size = _median_width((one.vertices, one.faces) for one in scene.blocks) / overlay.cells
    contact, time, solver = _settings(overlay)
    return replace(
        scene,
        blocks=tuple(_block(one, overlay, size, one.code in listed) for one in scene.blocks),
        contact=replace(scene.contact, **contact),
        time=replace(scene.time, **time),
        solver=replace(scene.solver, **solver),
    )


def typical_width(models: Iterable[StoneModel]) -> float:
    """Median of the smallest widths of surveyed stones [m]."""
    return _median_width((one.record.solid_vertices, one.record.solid_faces) for one in models)


def _median_width(solids: Iterable[tuple[Array, tuple[tuple[int, ...], ...]]]) -> float:
    return float(np.median([smallest_width(vertices, faces) for vertices, faces in solids]))


def _block(block: Block, overlay: Overlay, size: float | None, listed: bool) -> Block:
    keeps = listed or block.fidelity is Fidelity.FIXED
    fidelity = block.fidelity if keeps or overlay.fidelity is None else overlay.fidelity
    if fidelity is not Fidelity.DEFORMABLE:
        return replace(block, fidelity=fidelity, mesh_size=None)
    mesh: dict[str, Any] = {} if size is None else {"mesh_size": size, "contact_size": None}
    return replace(block, fidelity=fidelity, **_given({"element": overlay.element}), **mesh)


def _settings(overlay: Overlay) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Of contact, time and solver, those that the overlay gives."""
    solver = ("method", "tolerance", "velocity_tolerance", "max_iterations")
    contact, time, own = (
        _given({name: getattr(overlay, name) for name in names})
        for names in (("points", "placement"), ("step", "theta"), solver)
    )
    return contact, time, own


def _given(values: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if value is not None}
