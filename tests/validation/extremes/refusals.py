"""Input that makes no sense: each of these is to be refused, in words that name the place, the value and a remedy."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.extremes.stones import box, ground, standing
from mechanics.scene.laws.cohesive_zone import CohesiveZone
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.laws.lennard_jones import LennardJones
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion, settlement
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import Block, ContactSettings, Fidelity, Scene, SolverSettings, TimeSettings
from mechanics.simulate import simulate
from mechanics.stones.materials import Material, Orthotropy

Run = Callable[[], object]

_NAN, _INF = float("nan"), float("inf")


def refusals() -> Mapping[str, Run]:
    """Return by the name of what is asked a function that makes the value and, if it can be made, simulates it."""
    return {
        **_materials(),
        **_blocks(),
        **_settings(),
        **_laws(),
        **_loads(),
    }


def _materials() -> dict[str, Run]:
    sound: dict[str, Any] = {"name": "stone", "density": 2000.0, "young": 1e9, "poisson": 0.2}
    bad = {
        "density": (0.0, -1.0, _NAN, _INF, 1e-320),
        "young": (0.0, -1.0, _NAN, _INF),
        "poisson": (-0.1, 0.5, _NAN),
        "mass_damping": (-1.0, _NAN, _INF),
        "stiffness_damping": (-1.0, _NAN, _INF),
        "tensile_strength": (0.0, _NAN),
        "compressive_strength": (-1.0, _NAN),
    }
    rows: dict[str, Run] = {
        f"material: {name} = {value:g}": lambda n=name, v=value: _run_material(Material(**sound | {n: v}))  # type: ignore[misc]
        for name, values in bad.items()
        for value in values
    }
    for name, triple in (
        ("young", (1e9, 1e9, _NAN)),
        ("shear", (1e9, _INF, 1e9)),
        ("poisson", (0.2, 0.2, _NAN)),
    ):
        given: dict[str, Any] = {"young": (1e9,) * 3, "shear": (4e8,) * 3, "poisson": (0.2,) * 3} | {
            name: triple
        }
        rows[f"orthotropy: {name} = {triple[1]:g}, {triple[2]:g}"] = lambda g=given: _run_material(  # type: ignore[misc]
            Material(**sound, orthotropy=Orthotropy(**g))
        )
    return rows


def _run_material(material: Material) -> object:
    stone = replace(box("stone", [0, 0, 0], [1, 1, 1]), material=material)
    return _run(stone), _run(replace(stone, fidelity=Fidelity.DEFORMABLE, mesh_size=1.0))


def _run(*stones: Block, **settings: Any) -> object:
    return simulate(replace(standing((ground(), *stones)), **settings))


def _stone(**changes: Any) -> Block:
    return replace(box("stone", [0, 0, 0], [1, 1, 1]), **changes)


def _corner(value: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    corners = _stone().vertices.copy()
    corners[6, 2] = value
    return corners


def _blocks() -> dict[str, Run]:
    faces, still = _stone().faces, (0.0,) * 6
    elastic: dict[str, Any] = {"fidelity": Fidelity.DEFORMABLE, "mesh_size": 1.0}
    changes: dict[str, dict[str, Any]] = {
        **{f"a corner at {value:g}": {"vertices": _corner(value)} for value in (_NAN, _INF, 1e200)},
        "corners in the plane": {"vertices": np.zeros((8, 2))},
        "no thickness": {"vertices": _stone().vertices * [1.0, 1.0, 0.0]},
        "1e-200 m wide": {"vertices": 1e-200 * _stone().vertices},
        "1e-60 m wide": {"vertices": 1e-60 * _stone().vertices},
        "1e200 m wide": {"vertices": 1e200 * _stone().vertices},
        "inside out": {"faces": tuple(face[::-1] for face in faces)},
        "a face of corners that are not there": {"faces": (*faces[:-1], (3, 0, 4, 8))},
        "a face of two corners": {"faces": (*faces, (0, 1))},
        "a face of corner -1": {"faces": (*faces[:-1], (3, 0, 4, -1))},
        "an open side": {"faces": faces[:-1]},
        **{f"velocity {value:g}": {"velocity": (value, *still[1:])} for value in (_NAN, _INF, 1e200)},
        "velocity of three components": {"velocity": (1.0, 0.0, 0.0)},
        **{f"mesh_size = {value:g}": elastic | {"mesh_size": value} for value in (0.0, -1.0, _NAN, _INF)},
        **{f"contact_size = {value:g}": elastic | {"contact_size": value} for value in (0.0, -1.0, _NAN)},
        **{f"growth = {value:g}": elastic | {"contact_size": 0.5, "growth": value} for value in (-1.0, _NAN)},
        **{f"radius = {value:g}": {"radius": value} for value in (0.0, -1.0, _NAN, _INF)},
    }
    return {f"stone: {name}": lambda c=change: _run(_stone(**c)) for name, change in changes.items()}  # type: ignore[misc]


def _settings() -> dict[str, Run]:
    rows: dict[str, Run] = {
        f"scene: gravity {value:g}": lambda v=value: _run(_stone(), gravity=(0.0, 0.0, v))  # type: ignore[misc]
        for value in (_NAN, _INF, 1e300)
    }
    rows["scene: no stone"] = lambda: Scene("empty", ())
    rows["scene: one code twice"] = lambda: Scene("twice", (_stone(), _stone()))
    rows["scene: frame_every = -1"] = lambda: _run(_stone(), frame_every=-1)
    bad: dict[str, tuple[Callable[..., object], dict[str, tuple[float, ...]]]] = {
        "time": (
            TimeSettings,
            {
                "step": (0.0, -1e-3, _NAN, _INF),
                "theta": (0.4, 1.1, _NAN),
                "duration": (0.0, -1.0, _NAN, _INF),
                "balance_tolerance": (0.0, -1.0, _NAN),
                "collapse_displacement": (0.0, -1.0, _NAN),
                "sleep": (-1.0, _NAN, _INF),
            },
        ),
        "solver": (
            SolverSettings,
            {
                "tolerance": (0.0, -1.0, _NAN, _INF),
                "velocity_tolerance": (0.0, -1.0, _NAN),
                "max_iterations": (0, -1),
                "threads": (0, -1),
            },
        ),
        "contact": (ContactSettings, {"alert_distance": (0.0, -1.0, _NAN, _INF), "points": (0, 2, 100)}),
    }
    for place, (make, keys) in bad.items():
        for key, values in keys.items():
            for value in values:
                rows[f"{place}: {key} = {value:g}"] = lambda p=place, m=make, k=key, v=value: _run(  # type: ignore[misc]
                    _stone(), **{p: m(**{k: v})}
                )
    return rows


def _laws() -> dict[str, Run]:
    bad: dict[str, tuple[Callable[..., object], dict[str, float]]] = {
        "dry joint": (DryJoint, {"friction": 0.6}),
        "mortar": (MortarJoint, {"friction": 0.6, "tension": 1e5, "shear": 1e5}),
        "cohesive zone": (
            CohesiveZone,
            {"friction": 0.6, "tension": 1e5, "shear": 1e5, "energy_tension": 10.0, "energy_shear": 10.0},
        ),
        "elastic joint": (
            ElasticJoint,
            {"friction": 0.6, "normal_stiffness": 1e9, "shear_stiffness": 1e9, "damping_time": 1e-4},
        ),
        "Lennard-Jones": (LennardJones, {"friction": 0.6, "force": 1.0, "distance": 1e-3}),
    }
    return {
        f"{law}: {key} = {value:g}": lambda m=make, g=given, k=key, v=value: m(**g | {k: v})  # type: ignore[misc]
        for law, (make, given) in bad.items()
        for key in given
        for value in (-1.0, _NAN, _INF)
    }


def _loads() -> dict[str, Run]:
    push, who = History.constant([1.0, 0.0, 0.0]), frozenset({"stone"})

    force: dict[str, Any] = {"stones": who, "force": push}
    motion: dict[str, Any] = {"stones": frozenset({"ground"}), "velocity": push}

    def pushed(**changes: Any) -> object:
        return _run(_stone(), loads=Loads(forces=(StoneForce(**force | changes),)))

    def driven(**changes: Any) -> object:
        return _run(_stone(), loads=Loads(motions=(ImposedMotion(**motion | changes),)))

    return {
        "force: a value of nan": lambda: pushed(force=History.constant([_NAN, 0.0, 0.0])),
        "force: a value of 1e300 N": lambda: pushed(force=History.constant([1e300, 0.0, 0.0])),
        "force: its arm nan": lambda: pushed(arm=(_NAN, 0.0, 0.0)),
        "force: its arm inf": lambda: pushed(arm=(0.0, _INF, 0.0)),
        "force: on a stone that is not there": lambda: pushed(stones=frozenset({"other"})),
        "motion: its pivot nan": lambda: driven(pivot=(_NAN, 0.0, 0.0)),
        "motion: of a stone that is not fixed": lambda: driven(stones=who),
        "settlement: within 0 s": lambda: settlement(["ground"], (0.0, 0.0, -1.0), 0.0),
        "settlement: by nan": lambda: settlement(["ground"], (0.0, 0.0, _NAN), 1.0),
        "settlement: from nan s": lambda: settlement(["ground"], (0.0, 0.0, -1.0), 1.0, _NAN),
    }
