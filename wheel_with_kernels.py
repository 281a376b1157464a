"""Build backend of MOMA: setuptools', whose wheels carry compiled kernels too (`ground.kernels.packed` uses them).

They are compiled for a level of processors, not for the one at hand, and in a copy of the packages: what a source tree
has in its own cache may be of another processor or of older callees. Only Linux on x86-64 has such a level that we name
here; wheels of other systems have no kernels, nor have editable installations.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from setuptools import build_meta
from setuptools.build_meta import *  # noqa: F403 - the other hooks are setuptools'

_PLATFORM = "linux-x86_64"
# a kernel that does not compile here would be compiled by each user
_EVERY_KERNEL = "from ground.kernels.uses import all_kernels; [use.compile() for use in all_kernels()]"
_FEATURES = (
    *(
        "64bit",
        "cmov",
        "cx16",
        "cx8",
        "fxsr",
        "mmx",
        "sahf",
        "sse",
        "sse2",
        "sse3",
        "sse4.1",
        "sse4.2",
        "ssse3",
    ),
    *("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "popcnt", "xsave"),
)
_TARGET = {"NUMBA_CPU_NAME": "x86-64-v3", "NUMBA_CPU_FEATURES": ",".join(f"+{one}" for one in _FEATURES)}
"""Processors with AVX2 and FMA: Intel's since 2013, AMD's since 2015. numba would add the features of the processor at
hand to a name without features."""

_TAG = "manylinux_2_28_x86_64"
"""Tag of the wheels, which PyPI takes: kernels are no shared libraries, and call nothing but what numba finds in the
process; numba's own wheels need glibc 2.27."""

_SOURCES = ("ground", "moma", "survey", "archmodel", "mechanics", "pipelines")


def get_requires_for_build_wheel(config_settings: Mapping[str, Any] | None = None) -> list[str]:
    """Return what compiling kernels needs, besides what setuptools needs."""
    asked = build_meta.get_requires_for_build_wheel(config_settings)
    return [*asked, "numba>=0.68", "scipy>=1.14"] if sysconfig.get_platform() == _PLATFORM else asked


def build_wheel(
    wheel_directory: str,
    config_settings: Mapping[str, Any] | None = None,
    metadata_directory: str | None = None,
) -> str:
    """Build a wheel, with kernels where this is a system that they are built for."""
    if sysconfig.get_platform() != _PLATFORM:
        return build_meta.build_wheel(wheel_directory, config_settings, metadata_directory)
    home, wheels = Path.cwd(), Path(wheel_directory).resolve()
    with TemporaryDirectory() as folder:
        for name in _SOURCES:
            shutil.copytree(name, Path(folder, name), ignore=shutil.ignore_patterns("__pycache__"))
        for name in ("pyproject.toml", "README.md", "LICENSE"):
            shutil.copy(name, folder)
        os.chdir(folder)
        try:
            _pin_numba()
            _compile_kernels()
            python = f"cp{sys.version_info.major}{sys.version_info.minor}"
            tags = ["--python-tag", python, "--plat-name", _TAG]
            return build_meta.build_wheel(str(wheels), {**(config_settings or {}), "--build-option": tags})
        finally:
            os.chdir(home)


def _pin_numba() -> None:
    """Have the wheel require the version of numba that reads its kernels: another would compile everything anew."""
    project = Path("pyproject.toml")
    text, count = re.subn(
        r'"numba>=[^"]*"', f'"numba=={version("numba")}"', project.read_text(encoding="utf-8")
    )
    if count != 1:
        raise RuntimeError(f"pyproject.toml requires numba {count} times")
    project.write_text(text, encoding="utf-8")


def _compile_kernels() -> None:
    """Compile the usual kernels of the packages in the current folder into their caches; take down what fits them."""
    environment = {name: text for name, text in os.environ.items() if not name.startswith("NUMBA_")}
    # SVML is a library of its own, which numba uses where it is installed
    environment |= {**_TARGET, "NUMBA_DISABLE_INTEL_SVML": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    environment["PYTHONPATH"] = os.pathsep.join((os.getcwd(), *filter(None, sys.path)))
    subprocess.run([sys.executable, "-P", "-c", _EVERY_KERNEL], env=environment, check=True)
    fitting = {
        "python": sysconfig.get_python_version(),
        "numba": version("numba"),
        "environment": _TARGET,
    }
    Path("ground/kernels/packed.json").write_text(json.dumps(fitting, indent=1) + "\n", encoding="utf-8")
