"""One scene at other settings: what a profile, or a point of a study of speed against accuracy, changes of it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from mechanics.meshing.elements import Element
from mechanics.scene import Fidelity, Method, Placement
from pipelines.scenefile import SceneFile

__all__ = ["Overlay", "overlaid"]


@dataclass(frozen=True)
class Overlay:
    """Settings that replace those of a scene; None leaves what the scene says.

    Selection, materials, laws, loads and supports are the scene's own. Lists of stones in [bodies] go before
    `fidelity`, as they go before its `default`.

    Attributes
    ----------
    fidelity : of stones that no list names
    element : kind of finite elements
    cells : their number along the typical (median) smallest width of the stones; stands for the size of the mesh [-]
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
    bodies = {"default": overlay.fidelity}
    mesh = {"element": overlay.element, "size": None if overlay.cells is None else width / overlay.cells}
    contact = {"points": overlay.points, "placement": overlay.placement}
    time = {"step": overlay.step, "theta": overlay.theta}
    solver = {
        "method": overlay.method,
        "tolerance": overlay.tolerance,
        "velocity_tolerance": overlay.velocity_tolerance,
        "max_iterations": overlay.max_iterations,
    }
    return replace(
        scene,
        bodies=replace(scene.bodies, **_given(bodies)),
        mesh=replace(scene.mesh, **_given(mesh)),
        contact=replace(scene.contact, **_given(contact)),
        time=replace(scene.time, **_given(time)),
        solver=replace(scene.solver, **_given(solver)),
    )


def _given(values: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if value is not None}
