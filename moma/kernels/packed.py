"""Compiled kernels that a wheel carries: whether they fit this machine, and what numba must know to read them.

numba looks a kernel up in the cache beside its source by the versions of numba and Python, by a hash of the source, and
by the processor's name and features. The kernels of a wheel (`wheel_with_kernels.py`) are for a level of processors, so
numba must be told, before it is loaded, to compile for that level; what the wheel lacks is then compiled for it too.
"""

import json
import os
import sys
import sysconfig
from pathlib import Path
from typing import Any

__all__ = ["use_packed_kernels"]

_FITTING = Path(__file__).with_name("packed.json")


def use_packed_kernels() -> None:
    """Have numba read the kernels of the wheel, if this is one, they fit, and nobody has told numba otherwise."""
    if "numba" in sys.modules or not _FITTING.exists():
        return
    fitting = json.loads(_FITTING.read_text(encoding="utf-8"))
    if not os.environ.keys() & fitting["environment"].keys() and _fits(fitting):
        os.environ.update(fitting["environment"])


def _fits(fitting: dict[str, Any]) -> bool:
    """Return whether this machine reads and runs such kernels."""
    from importlib.metadata import version

    if (sysconfig.get_python_version(), version("numba")) != (fitting["python"], fitting["numba"]):
        return False
    needed = {one.lstrip("+") for one in fitting["environment"]["NUMBA_CPU_FEATURES"].split(",")}
    return needed <= _features()


def _features() -> set[str]:
    """Return the processor's features, in LLVM's names."""
    from llvmlite.binding import get_host_cpu_features  # part of numba, which is needed next

    return {name for name, there in get_host_cpu_features().items() if there}
