"""Atomic replacement of result folders: all files appear or none, and only earlier results are replaced."""

import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from moma.errors import UsageError

__all__ = ["check_replaceable", "replacing"]

_INDEX = "summary.json"  # its "files" lists the files that a run wrote


def check_replaceable(folder: Path, index: str = _INDEX) -> None:
    """Refuse to replace a file, or a folder that holds anything other than earlier results.

    Parameters
    ----------
    folder : the place
    index : name of the JSON file whose "files" lists all results

    Raises
    ------
    UsageError : naming what is there
    """
    place, remedy = str(folder), "name another folder"
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        raise UsageError("is not a folder", where=place, remedy=remedy)
    if not folder.exists():
        return
    foreign = sorted({entry.name for entry in folder.iterdir()} - _own_files(folder, index))
    if foreign:
        shown = ", ".join(foreign[:3]) + (", …" if len(foreign) > 3 else "")
        raise UsageError(f"holds files that no run of MOMA wrote ({shown})", where=place, remedy=remedy)


@contextmanager
def replacing(folder: Path, index: str = _INDEX) -> Iterator[Path]:
    """Yield a fresh folder, which replaces `folder` when the block ends without an error.

    If the block fails or is interrupted, `folder` stays as it was.
    """
    check_replaceable(folder, index)
    parent = folder.absolute().parent
    try:
        parent.mkdir(parents=True, exist_ok=True)
        fresh = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=parent))
    except OSError as error:
        raise UsageError(
            f"cannot be written: {error.strerror}", where=str(parent), remedy="name another folder"
        ) from error
    try:
        yield fresh
        fresh.chmod(0o777 & ~_umask())  # mkdtemp makes it private
        check_replaceable(folder, index)
        if folder.exists():
            shutil.rmtree(folder)
        fresh.rename(folder.absolute())
    finally:
        shutil.rmtree(fresh, ignore_errors=True)


def _own_files(folder: Path, index: str) -> set[str]:
    """List the files that the index in a folder names."""
    try:
        files = json.loads((folder / index).read_text(encoding="utf-8"))["files"]
    except (OSError, ValueError, LookupError, TypeError):
        return set()
    return {index, *map(str, files)} if isinstance(files, list) else set()


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
