"""LMGC90 on one scene: a process of its own, run by benchmarks.lmgc90 with the interpreter that has `compas_lmgc90`.

It needs numpy and that package alone, so that interpreter need not have MOMA. LMGC90 keeps one simulation
per process and ends the process where it is used wrongly; so each run is one process, and leaves one .npz file behind.

The package drives LMGC90's Fortran routines, which its library also exports: `relaxation` calls them one by one, in
the order of the package's own step, with another relaxation of the sweeps than the 0.1 that the package fixes.
`gravity`, a .npy (steps, 3), gives each step a gravity of its own [m/s²].
"""

import ctypes
import json
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

import numpy as np

# LMGC90's number for contacts between polyhedra, the norm and the tolerance of its sweeps as the package sets them
_POLYHEDRA, _NORM, _TOLERANCE = 18, b"QM/16", 1.666e-4
_CHECK_EVERY, _CHECKS = 50, 500


def main() -> None:
    """`lmgc90_child.py SCENE OUT SETTINGS`: run, and write times, motion and contacts to OUT."""
    path, out, settings = sys.argv[1], sys.argv[2], json.loads(sys.argv[3])
    solver = _solver(path, settings)
    from compas_lmgc90 import _lmgc90

    library = ctypes.CDLL(_lmgc90.__file__)
    step = solver.lmgc90.compute_one_step
    if "relaxation" in settings:
        step = _Driven(library, settings["relaxation"], _TOLERANCE)
    gravity = np.load(settings["gravity"]) if "gravity" in settings else None
    steps, keep = settings["steps"], settings.get("keep", 0)
    result = solver.lmgc90.get_initial_state()
    centre = [np.array(result.init_bodies)]
    frame = [_frames(result.init_body_frames)]
    cpu, sweeps, contacts, kept = [], [], [], {}
    for n in range(1, steps + 1):
        if gravity is not None:
            library["__bulk_behaviour_MOD_set_gravity"]((ctypes.c_double * 3)(*gravity[n - 1]))
        start = time.process_time()
        result = step()
        cpu.append(time.process_time() - start)
        done, touching = _sweeps(library)
        sweeps.append(done)
        contacts.append(touching)
        centre.append(_centres(library, len(centre[0])))
        if result is None:  # routine by routine there are no axes and no contacts to read back
            continue
        frame.append(_frames(result.body_frames))
        if keep and (n == 1 or n > steps - keep):
            kept[n] = _contacts(result)
    np.savez(
        out,
        program=f"compas_lmgc90 {version('compas_lmgc90')}",
        cpu=cpu,
        sweeps=sweeps,
        contacts=contacts,
        solved=np.array(sweeps) < _CHECK_EVERY * _CHECKS,
        compliant=np.zeros(len(sweeps), dtype=bool),
        centre=centre,
        frame=frame,
        kept=list(kept),
        **{f"{key}_{n}": value for n, contacts in kept.items() for key, value in contacts.items()},
    )


def _solver(path: str, settings: dict[str, Any]) -> Any:
    """The package's solver with the scene in it, ready to step."""
    from compas_lmgc90.solver import Solver

    with np.load(path) as data:
        scene = {key: data[key] for key in data.files}
    solver = Solver(dt=settings["step"], theta=settings["theta"], density=float(scene["density"]))
    vptr, fptr = scene["vptr"], scene["fptr"]
    solver.geometry_from_v_f(
        [
            {
                "vertices": scene["verts"][vptr[b] : vptr[b + 1]].tolist(),
                "faces": scene["faces"][fptr[b] : fptr[b + 1]].tolist(),
            }
            for b in range(len(vptr) - 1)
        ]
    )
    for b in np.flatnonzero(scene["support"]):
        for component in ("Vx", "Vy", "Vz", "Rx", "Ry", "Rz"):
            solver.apply_velocity(int(b), component, np.zeros((1, 6)))
    solver.contact_law("IQS_CLB", float(scene["friction"]))
    solver.preprocess()
    return solver


def _frames(frames: Any) -> Any:
    """Principal axes in rows (nb, 3, 3) of the bodies."""
    return np.array(frames).reshape(-1, 3, 3)


def _centres(library: ctypes.CDLL, bodies: int) -> Any:
    """Centres of mass (nb, 3) of the bodies, as the library holds them."""
    found, six, name = (ctypes.c_double * 6)(), ctypes.c_int(6), b"Coor_"
    ask, centres = library["__rbdy3_MOD_get_vector_rbdy3"], np.empty((bodies, 3))
    for body in range(bodies):
        # Fortran counts from 1, and passes the length of the text behind the other arguments
        number = ctypes.c_int(body + 1)
        ask(name, ctypes.byref(number), found, ctypes.byref(six), ctypes.c_size_t(len(name)))
        centres[body] = found[:3]
    return centres


def _contacts(result: Any) -> dict[str, Any]:
    """The contacts of one step; LMGC90's axes (t, n, s) become (n, t, s), forces are in newtons on the candidate."""
    axes = np.array(result.interaction_uc).reshape(-1, 3, 3)
    return {
        "body": np.array(result.interaction_bodies) - 1,
        "point": np.array(result.interaction_coords),
        "frame": axes[:, [1, 0, 2]],
        "gap": np.array(result.interaction_gap),
        "force": np.array(result.interaction_rloc)[:, [1, 0, 2]],
    }


def _sweeps(library: ctypes.CDLL) -> tuple[int, int]:
    """Sweeps and contacts of the last step; -1 where the library does not say."""
    try:
        ask = library["__nlgs_3d_MOD_get_nlgs3d_loop"]
    except AttributeError:
        return -1, -1
    count, contacts = ctypes.c_int(), ctypes.c_int()
    errors = [ctypes.byref(ctypes.c_double()) for _ in range(3)]
    ask(ctypes.byref(count), *errors, ctypes.byref(contacts))
    return count.value, contacts.value


class _Driven:
    """The package's step, routine by routine, with another relaxation."""

    def __init__(self, library: ctypes.CDLL, relaxation: float, tolerance: float) -> None:
        self._library = library
        self._relaxation, self._tolerance = ctypes.c_double(relaxation), ctypes.c_double(tolerance)
        self._first = True

    def _call(self, module: str, routine: str, *arguments: Any) -> int:
        found: Callable[..., int] = self._library[f"__{module}_MOD_{routine}"]
        return found(*(a if a is None or isinstance(a, bytes) else ctypes.byref(a) for a in arguments))

    def __call__(self) -> None:
        call, one = self._call, ctypes.c_int(1)
        for routine in ("clean_writing_flags", "time_increment", "display_time"):
            call("overall", routine)
        for routine in ("increment_rbdy3", "comp_fext_rbdy3", "comp_fint_rbdy3", "comp_free_vlocy_rbdy3"):
            call("rbdy3", routine)
        call("overall", "init_entitylist")
        call("overall", "set_run_contactor", one)
        if call("prprx", "check_prprx"):
            self._detect()
        call("inter_meca_handler_3d", "recup_rloc", ctypes.c_int(_POLYHEDRA))
        self._sweep()
        call("nlgs_3d", "nullify_entitylist_nlgs")
        call("nlgs_3d", "update_tact_behav_nlgs")
        call("inter_meca_handler_3d", "stock_rloc", ctypes.c_int(_POLYHEDRA))
        call("rbdy3", "comp_dof_rbdy3")
        call("overall", "updt_time_begin")
        call("rbdy3", "update_dof_rbdy3")

    def _detect(self) -> None:
        if self._first:
            self._call("prprx", "compute_box_prprx")
            self._first = False
        self._call("prprx", "coor_prediction_prprx")
        if self._call("prprx", "run_prprx"):
            self._call("prprx", "creation_tab_visu_prprx")
        self._call("prprx", "sto_compute_contact_prprx", None)

    def _sweep(self) -> None:
        call, left = self._call, ctypes.c_int()
        iterate, check, finish = (ctypes.c_int(n) for n in (1, 2, 3))
        # Fortran passes the length of the text behind the other arguments
        setting = self._library["__nlgs_3d_MOD_set_nlgs_parameter"]
        tolerance, relaxation = ctypes.byref(self._tolerance), ctypes.byref(self._relaxation)
        setting(_NORM, tolerance, relaxation, ctypes.c_size_t(len(_NORM)))
        call("nlgs_3d", "prep_nlgs", ctypes.c_int(1))
        for _ in range(_CHECKS):
            for _ in range(_CHECK_EVERY):
                call("nlgs_3d", "solve_nlgs", iterate)
            call("nlgs_3d", "prep_check_nlgs", left)
            call("nlgs_3d", "solve_nlgs", check)
            call("nlgs_3d", "comp_check_nlgs", left)
            if left.value == 0:
                break
        call("nlgs_3d", "rnodhrloc_nlgs", None, None)
        call("nlgs_3d", "solve_nlgs", finish)


if __name__ == "__main__":
    main()
