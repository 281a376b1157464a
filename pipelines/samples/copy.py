"""Copy a shipped sample into a folder, to start from."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any
from zipfile import ZipFile

from ground.errors import UsageError, storing

SHIPPED = Path(__file__).parent / "files"
"""Folder of the archives, one a sample, and of their catalogue."""

FOLDER = "@FOLDER@"
"""Folder of a sample in the commands and scene files that are shipped."""

_RENAMED = {
    "core-sunk": "facings --moved settlement",
    "pushed": "wall --moved thrust",
    "settled": "wall --moved settlement",
    "settled-phases": "wall --moved settlement --phases",
    "settled-small": "wall --moved settlement --small",
    "shaken": "wall --moved earthquake",
    "tower-settled-small": "tower --moved settlement --small",
    "tower-small": "tower --small",
}  # by their former names


@dataclass(frozen=True)
class WrittenSample:
    """Files of a sample.

    Attributes
    ----------
    kind, title : the sample
    stones : their number in the survey
    files : paths of the survey, its truth, the scene, what is known besides, and stones that are closed solids
    commands : that take the survey to the results of the scene, in order
    synthetic : there is no such wall
    """

    kind: str
    title: str
    stones: int
    files: tuple[str, ...]
    commands: tuple[str, ...]
    synthetic: bool = True


@cache
def _catalogue() -> Mapping[str, Mapping[str, Any]]:
    catalogue: dict[str, dict[str, Any]] = json.loads(
        (SHIPPED / "catalogue.json").read_text(encoding="utf-8")
    )
    return catalogue


def sample_names() -> tuple[str, ...]:
    """Return the samples as they are written after `moma sample`."""
    return tuple(_catalogue())


def copy_sample(
    kind: str,
    folder: Path,
    *,
    moved: str | None = None,
    small: bool = False,
    phases: bool = False,
    scan: bool = False,
    photographs: bool = False,
) -> WrittenSample:
    """Copy a sample into a folder, created if necessary; its scene files and commands name the folder.

    Parameters
    ----------
    kind : name of the building
    moved : cause of its movement; None: it stands as built
    small : a smaller building, plainer
    phases : its upper courses were laid after it moved
    scan : it was scanned too, and outlines were drawn
    photographs : marks on photographs of it too

    Raises
    ------
    UsageError
        if there is no such sample, or a file would be overwritten
    StorageError
        if the disk is full, for example; none of the files is left then
    """
    options = {"small": small, "phases": phases, "scan": scan, "photographs": photographs}
    movement = [] if moved is None else [f"--moved {moved}"]
    name = " ".join([kind, *movement, *(f"--{option}" for option, chosen in options.items() if chosen)])
    if kind in _RENAMED:
        raise UsageError(f"no sample {kind!r} any more", remedy=f"it is now: moma sample {_RENAMED[kind]}")
    if (entry := _catalogue().get(name)) is None:
        kinds = [sample for sample in sample_names() if " " not in sample]
        variants = [f"'{sample}'" for sample in sample_names() if sample.split()[0] == kind]
        remedy = f"there is {', '.join(variants)}" if variants else f"the samples are {', '.join(kinds)}"
        raise UsageError(f"no sample {name!r}", remedy=remedy)
    with ZipFile(SHIPPED / entry["archive"]) as archive:
        contents = {folder / member: archive.read(member) for member in archive.namelist()}
    place = str(folder)
    write_new(
        folder,
        {
            path: content.replace(FOLDER.encode(), place.encode()) if path.suffix == ".toml" else content
            for path, content in contents.items()
        },
    )
    commands = tuple(command.replace(FOLDER, place) for command in entry["commands"])
    files = tuple(str(folder / file) for file in entry["files"])
    return WrittenSample(kind, entry["title"], entry["stones"], files, commands, entry["synthetic"])


def write_new(folder: Path, contents: Mapping[Path, bytes]) -> None:
    """Write files into a folder, created if necessary; none is left where one cannot be written.

    Raises
    ------
    UsageError
        if one of them exists
    StorageError
        if the disk is full, for example
    """
    for path in contents:
        if path.exists():
            raise UsageError(f"{path} exists", remedy="name another folder: --out DIR")
    with storing(str(folder)):
        folder.mkdir(parents=True, exist_ok=True)
        try:
            for path, content in contents.items():
                path.write_bytes(content)
        except BaseException:
            for path in contents:
                path.unlink(missing_ok=True)
            raise
