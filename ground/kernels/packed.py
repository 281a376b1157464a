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

_FITTING = Path(__file__).with_name("packed.json")

_WARNED = "MOMA_KERNELS_SAID"
"""Variable of the environment that is set once the reason has been said."""


def use_packed_kernels() -> None:
    """Have numba read the kernels of the wheel, if this is one, they fit, and nobody has told numba otherwise."""
    if "numba" in sys.modules or not _FITTING.exists():
        return
    fitting = json.loads(_FITTING.read_text(encoding="utf-8"))
    if os.environ.keys() & fitting["environment"].keys():
        return
    reason = _misfit(fitting)
    if reason is None:
        os.environ.update(fitting["environment"])
    elif _WARNED not in os.environ:
        os.environ[_WARNED] = "1"  # processes that this one starts say it no more
        print(f"moma: warning: {reason}; kernels are compiled here, once: moma warm-up", file=sys.stderr)


def _misfit(fitting: dict[str, Any]) -> str | None:
    """Return why this machine does not read or run such kernels; None if it does."""
    from importlib.metadata import version

    for name, here, there in (
        ("Python", sysconfig.get_python_version(), fitting["python"]),
        ("numba", version("numba"), fitting["numba"]),
    ):
        if here != there:
            remedy = f": pip install numba=={there}" if name == "numba" else ""
            return f"the kernels of this wheel are for {name} {there}, here is {here}{remedy}"
    needed = {word.lstrip("+") for word in fitting["environment"]["NUMBA_CPU_FEATURES"].split(",")}
    lacking = sorted(needed - _features())
    if lacking:
        return f"the kernels of this wheel need a processor with {', '.join(lacking)}"
    if not os.access(_FITTING.parent, os.W_OK):
        return f"numba reads no kernels of a folder that is read-only, {_FITTING.parent}"
    return None


def _features() -> set[str]:
    """Return the processor's features, in LLVM's names."""
    from llvmlite.binding import get_host_cpu_features  # part of numba, which is needed next

    return {name for name, there in get_host_cpu_features().items() if there}
