"""First use of an installed wheel: sizes, processor times, and kernels that it still compiles.

``python -m benchmarks.installation``, or ``python -m benchmarks.first_use --installed``, builds the wheel, unpacks it
into an environment of its own, which shares the other packages with this one, and runs the matrix of
`benchmarks.first_use` there twice; with ``--write`` docs/design/first-use.md gets the tables (Linux).
"""

import argparse
import os
import re
import resource
import subprocess
import sys
import venv
import zipfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from tempfile import TemporaryDirectory

from packaging.requirements import Requirement

from benchmarks.first_use import MATRIX, SAMPLE
from benchmarks.report import machine
from tests.pipelines.scenes import small_geology

PAGE = Path("docs/design/first-use.md")
_MEGABYTE = 1e6
_LARGEST = 7  # packages that are listed by name
_LONGEST = 120  # processor time after which a command of the matrix is ended [s]
_BUILD = (sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", ".", "--wheel-dir")


@dataclass(frozen=True)
class Use:
    """A command of the matrix: processor times of its first and second use [s], new kernels of the first."""

    command: str
    first: float
    second: float
    compiled: int


def base_packages(name: str = "moma-masonry") -> dict[str, float]:
    """Return the sizes [MB] of all packages that an installation without extras brings, by name."""
    sizes: dict[str, float] = {}
    waiting = [name]
    while waiting:
        distribution = metadata.distribution(waiting.pop())
        label = distribution.metadata["Name"].lower()
        if label in sizes:
            continue
        sizes[label] = 0.0 if label == name else _size(distribution)
        for text in distribution.requires or ():
            requirement = Requirement(text)
            if requirement.marker is None or requirement.marker.evaluate({"extra": ""}):
                waiting.append(requirement.name)
    return sizes


def _size(distribution: metadata.Distribution) -> float:
    """Return what a package takes on the disk, without byte code [MB]."""
    paths = (Path(str(distribution.locate_file(file))) for file in distribution.files or ())
    return sum(path.stat().st_size for path in paths if path.suffix != ".pyc" and path.is_file()) / _MEGABYTE


def _processor_time() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _timed(call: list[str], folder: Path, environment: dict[str, str], must: bool = True) -> float:
    """Return the processor time of a process, which is ended after `_LONGEST` [s]; it must not fail before."""
    began = _processor_time()
    with (folder / "log.txt").open("ab") as log:
        done = subprocess.run(
            call, cwd=folder, env=environment, stdout=log, stderr=log, check=False, preexec_fn=_limit
        )
    took = _processor_time() - began
    if must and done.returncode != 0 and took < _LONGEST - 1:
        last = (folder / "log.txt").read_text(encoding="utf-8").splitlines()[-1]
        raise RuntimeError(f"{' '.join(call)} ended with {done.returncode}: {last}")
    return took


def _limit() -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (_LONGEST, _LONGEST))


def _kernels(*folders: Path) -> set[Path]:
    return {path for folder in folders for path in folder.rglob("*.nbc")}


def _installed(wheel: Path, folder: Path) -> Path:
    """Unpack a wheel into a new environment that shares the other packages; return its packages."""
    venv.create(folder)
    (packages,) = folder.glob("lib/python*/site-packages")
    shared = [path for path in sys.path if Path(path).name == "site-packages"]
    (packages / "shared.pth").write_text("\n".join(shared), encoding="utf-8")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(packages)
    return packages


def _uses(python: Path, packages: Path, folder: Path, commands: Iterable[str]) -> Iterator[Use]:
    """Run each command twice, and count the kernels that the first run adds anywhere."""
    cache = folder / "home"
    environment = {
        name: text for name, text in os.environ.items() if not name.startswith(("NUMBA_", "PYTHON"))
    }
    environment |= {"XDG_CACHE_HOME": str(cache), "MPLBACKEND": "Agg"}
    small_geology(folder / "geology")
    for line in commands:
        words = line.format(sample=SAMPLE.resolve(), geology=folder / "geology").split()
        before = _kernels(packages, cache)
        call = [str(python), "-P", "-m", "moma", *words]
        first = _timed(call, folder, environment)
        fresh = _kernels(packages, cache) - before
        # what was recorded is refused the second time
        second = _timed(
            [*call[:4], *_again(words)], folder, environment, must=words[0] not in ("record", "propose")
        )
        yield Use(line, first, second, len(fresh))


def _again(words: list[str]) -> list[str]:
    """Return the arguments that do the same once more, where the first results stay."""
    if words[0] == "ingest":  # the last is the database
        return [*words[:-1], words[-1].replace(".db", "-again.db")]
    if words[0] in ("sample", "trade"):  # the last is the folder
        return [*words[:-1], f"{words[-1]}-again"]
    return (
        [*words, "--overwrite"] if words[0] in ("run", "assess", "pushover", "diagnose", "geology") else words
    )


def tables(wheel: Path, compiled: float, uses: Iterable[Use], packages: dict[str, float]) -> str:
    """Return the tables of the page."""
    with zipfile.ZipFile(wheel) as archive:
        kernels = sum(name.endswith(".nbc") for name in archive.namelist())
    size, whole = wheel.stat().st_size / _MEGABYTE, sum(packages.values())
    largest = sorted(packages.items(), key=lambda item: -item[1])[:_LARGEST]
    named = ", ".join(f"{name} {size:.0f}" for name, size in largest)
    rows = "".join(
        f"| `moma {one.command.partition(' --db')[0]}` | {one.first:.1f} | {one.second:.1f} | {one.compiled} |\n"
        for one in uses
    )
    return (
        f"{machine()}. Processor times.\n\n| | |\n|---|---|\n"
        f"| wheel `{wheel.name}` | {size:.1f} MB, {kernels} compiled kernels, built in {compiled:.0f} s |\n"
        f"| clean installation | {len(packages)} packages, {whole:.0f} MB: {named} |\n\n"
        f"| command in a clean environment | first [s] | second [s] | new kernels |\n|---|---|---|---|\n{rows}"
    )


def _written(page: str, text: str) -> str:
    """Return the page with the tables between its marks."""
    begin, end = "<!-- measured -->\n", "<!-- end -->"
    return re.sub(f"(?<={begin}).*?(?={end})", lambda _: text, page, flags=re.DOTALL)


def main(write: bool = False, wheel: Path | None = None) -> None:
    """Measure, print the tables, and write them into the page if asked to."""
    with TemporaryDirectory() as name:
        folder, compiled = Path(name), 0.0
        if wheel is None:
            began = _processor_time()
            subprocess.run([*_BUILD, name], check=True)
            compiled = _processor_time() - began
            (wheel,) = folder.glob("*.whl")
        packages = _installed(wheel, folder / "new")
        (folder / "work").mkdir()
        uses = []
        for use in _uses(folder / "new/bin/python", packages, folder / "work", MATRIX):
            print(use, flush=True)
            uses.append(use)
        text = tables(wheel, compiled, uses, base_packages())
    print(text)
    if write:
        PAGE.write_text(_written(PAGE.read_text(encoding="utf-8"), text), encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="write the tables into docs/design/first-use.md")
    parser.add_argument("--wheel", type=Path, help="measure this wheel in place of building one")
    chosen = parser.parse_args()
    main(chosen.write, chosen.wheel)
