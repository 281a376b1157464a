"""The lists of kernels that a first use compiles, against the kernels themselves."""

import inspect
import subprocess
import sys
from collections import Counter
from importlib import import_module

import numba
import numpy as np
import pytest
from numba import njit

from ground.kernels.uses import COMMANDS, OTHERS, _decoded, _encoded, kernels_of, recording
from tests.paths import ROOT

USES = {
    f"{command}-{use.name}-{at}": use
    for command in (*COMMANDS, OTHERS)
    for at, use in enumerate(kernels_of(command))
}


@pytest.mark.parametrize("use", USES.values(), ids=USES)
def test_a_listed_kernel_exists_and_takes_the_listed_arguments(use):
    kernel = getattr(import_module(use.module), use.name)
    assert len(inspect.signature(kernel.py_func).parameters) == len(use.types)
    for given in use.types:
        kind = _decoded(given)
        assert _encoded(kind) == given
        if isinstance(kind, numba.types.BaseNamedTuple):
            assert len(kind.instance_class._fields) == len(kind.types)


def test_kernels_need_nothing_but_numba_and_scipy():
    """Wheels are built, and kernels compiled beside an installation, where no other package is there yet."""
    program = """
import sys
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("skfem", "meshio", "trimesh", "gmsh", "pyvista", "sqlalchemy", "shapely", "typer"):
            raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Absent())
from ground.kernels.uses import all_kernels, _decoded
from importlib import import_module
for use in all_kernels():
    import_module(use.module)
    for given in use.types:
        _decoded(given)
"""
    subprocess.run([sys.executable, "-c", program], check=True, cwd=ROOT)


def test_the_sample_compiles_each_kernel_for_one_kind_of_arguments():
    listed = Counter((use.module, use.name) for command in COMMANDS for use in kernels_of(command))
    # fronts are Fortran's, the blocks of stones C's: a copy of either would cost more than compiling does
    assert {name for (_, name), times in listed.items() if times > 1} == {"add_into"}


def test_kernels_that_python_calls_are_recorded_with_their_types():
    @njit
    def inner(numbers):
        return numbers[0, 0]

    @njit
    def outer(numbers, pair, asked):
        return inner(numbers) + pair[0] if asked else pair[1][0]

    readonly = np.zeros((2, 3))
    readonly.flags.writeable = False
    with recording() as uses:
        outer(readonly, (1, np.arange(6)[::2]), True)
    (use,) = uses
    assert use.types == (["float64", 2, "C", "readonly"], {"of": ["int64", ["int64", 1, "A"]]}, "bool")
    assert tuple(_decoded(one) for one in use.types) == outer.signatures[0]
