"""Atomic replacement of result folders: all files appear or none, and only earlier results are replaced.

The index of the results names the files that they are of (`source_of`). Results of others are replaced only where that
is asked for.

New results are written into a hidden folder beside the place, ``.NAME.moma-XXXXXXXX``, which then changes places with
the earlier ones. Where the system exchanges two names at once, there is an old or a new complete folder at every
instant. Elsewhere the earlier results wait as ``.NAME.moma-earlier`` between two renames; where a kill left them
there, the next command puts them back. Hidden folders of programs that have ended are removed; those of living ones
are locked.
"""

import ctypes
import errno
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from ground.errors import UsageError, storing

if sys.platform != "win32":
    import fcntl

RUN_INDEX = "summary.json"
"""Index of the results of a run."""

UNFINISHED = "unfinished"
"""Folder within that of the results, of a run that goes on or has been stopped."""

UNFINISHED_ASSESSMENT, UNFINISHED_DIAGNOSIS = "unfinished-assessment", "unfinished-diagnosis"
"""The same of an assessment, and of a diagnosis."""

_INDEXES = (
    RUN_INDEX,
    *("check.json", "cloud.json", "survey.json", "assessment.json", "comparison.json"),
    *("diagnosis.json", "orientation.json", "pushover.json", "outlines.json"),
)  # their "files" list the files that MOMA wrote
_UNFINISHED_RUNS = {
    UNFINISHED: (RUN_INDEX, "run"),
    UNFINISHED_ASSESSMENT: ("assessment.json", "assessment"),
    UNFINISHED_DIAGNOSIS: ("diagnosis.json", "diagnosis"),
}  # folders of unfinished work: the index of its results, and the name of the work
_SOURCE = "source"  # key of an index: the files that the results are of, relative to the folder
_MARK = ".moma-"  # in the names of hidden folders
_EARLIER = f"{_MARK}earlier"
_RANDOM = "?" * 8  # characters that tempfile adds to a name
_EXCHANGE = 2  # RENAME_EXCHANGE of Linux
_HERE = -100  # AT_FDCWD of Linux: paths are relative to the working directory
_CANNOT = {errno.ENOSYS, errno.EINVAL, errno.ENOTSUP, errno.EOPNOTSUPP}  # file systems without exchange


def check_replaceable(folder: Path, index: str = RUN_INDEX, source: Sequence[Path] = ()) -> None:
    """Refuse to replace a file, or a folder that holds anything other than what MOMA wrote.

    The results of a run are replaced by those of a run alone, and those of other files not at all.

    Parameters
    ----------
    folder : the place, which may be missing
    index : name of the JSON file of the new results whose "files" lists all of them
    source : files that the new results are of, as a scene; none: results of whatever files are replaced

    Raises
    ------
    UsageError : naming what is there
    """
    place, remedy = str(folder), "name another folder"
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        raise UsageError("is not a folder", where=place, remedy=remedy)
    _refuse_unwritable(folder)
    _recover(folder)
    if not folder.exists():
        return
    files_by_index = {name: _own_files(folder, name) for name in _INDEXES}
    foreign = sorted(_entries(folder) - set[str]().union(*files_by_index.values()))
    if foreign:
        shown = ", ".join(foreign[:3]) + (", …" if len(foreign) > 3 else "")
        raise UsageError(f"holds files that no run of MOMA wrote ({shown})", where=place, remedy=remedy)
    if files_by_index[RUN_INDEX] and index != RUN_INDEX:
        raise UsageError("holds the results of a run", where=place, remedy=remedy)
    for unfinished, (index_name, what) in _UNFINISHED_RUNS.items():
        if index != index_name and (folder / unfinished).exists():
            raise UsageError(f"holds an unfinished {what}", where=place, remedy=remedy)
    if source and (earlier := _source(folder)) not in (None, source_of(source, folder)):
        there = " and ".join(os.path.normpath(folder / name) for name in earlier or ())
        raise UsageError(
            f"holds the results of {there}", where=place, remedy=f"{remedy}, or replace them with --overwrite"
        )


def _refuse_unwritable(folder: Path) -> None:
    """Refuse a place that cannot be written before anything is computed for it."""
    parent = folder.absolute().parent
    while not parent.exists():
        parent = parent.parent
    for place in (parent, folder):
        if place.is_dir() and not os.access(place, os.W_OK | os.X_OK):
            raise UsageError(
                "the folder cannot be written",
                where=str(place),
                remedy="name another place, or change its permissions",
            )


@contextmanager
def replacing(folder: Path, index: str = RUN_INDEX) -> Iterator[Path]:
    """Yield a fresh folder, which replaces `folder` when the block ends without an error.

    If the block fails, is interrupted or killed, `folder` stays as it was.

    Raises
    ------
    UsageError : see `check_replaceable`
    StorageError : the disk is full, for example
    """
    check_replaceable(folder, index)
    target = folder.absolute()
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with locked(target.parent, wait=True):
            _clean(target.parent)
            fresh = Path(tempfile.mkdtemp(prefix=f".{target.name}{_MARK}", dir=target.parent))
            handle = _lock(fresh)
    except OSError as error:
        raise UsageError(
            f"cannot be written: {error.strerror}", where=str(target.parent), remedy="name another folder"
        ) from error
    try:
        earlier = any((folder / index).exists() for index in _INDEXES)
        with storing(str(folder), "earlier results there are as they were" if earlier else ""):
            yield fresh
            fresh.chmod(0o777 & ~_umask())  # mkdtemp makes it private
            check_replaceable(folder, index)
            _put(fresh, target)
    finally:
        shutil.rmtree(fresh, ignore_errors=True)
        if handle is not None:
            os.close(handle)


def source_of(files: Iterable[str | Path], folder: Path) -> list[str]:
    """Return the files that results are of, relative to their folder, so that both can be moved together.

    That is ``source`` in the index of the results. Files on another drive than the folder are absolute.
    """

    def relative(path: Path) -> str:
        """Return a path from the folder, or the whole path where there is none."""
        try:
            return Path(os.path.relpath(path, folder.resolve())).as_posix()
        except ValueError:
            return path.as_posix()

    return [relative(Path(file).resolve()) for file in files]


def _source(folder: Path) -> list[str] | None:
    """Return the files that the results in a folder are of; None if that is not known."""
    for index in _INDEXES:
        with suppress(OSError, ValueError, LookupError, TypeError):
            return list(map(str, json.loads((folder / index).read_text(encoding="utf-8"))[_SOURCE]))
    return None


def _put(fresh: Path, target: Path) -> None:
    """Give the fresh folder the name of the target; what had it has the name of the fresh one then, or is removed."""
    if not target.exists() or not any(target.iterdir()):
        fresh.rename(target)
    elif not _exchanged(fresh, target):
        earlier = target.with_name(f".{target.name}{_EARLIER}")
        with locked(target.parent, wait=True):
            target.rename(earlier)
            fresh.rename(target)
            shutil.rmtree(earlier)


def _exchanged(path: Path, target: Path) -> bool:
    """Exchange two names at once; return False where the system cannot."""
    if not sys.platform.startswith("linux"):
        return False
    rename = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if rename is None:
        return False
    if rename(_HERE, os.fsencode(path), _HERE, os.fsencode(target), _EXCHANGE) == 0:
        return True
    number = ctypes.get_errno()
    if number in _CANNOT:
        return False
    raise OSError(number, os.strerror(number), str(target))


def _recover(folder: Path) -> None:
    """Put earlier results back that a kill left between two renames, or remove them where the new ones are there."""
    target = folder.absolute()
    earlier = target.with_name(f".{target.name}{_EARLIER}")
    if not earlier.is_dir():
        return
    with suppress(OSError), locked(target.parent, wait=True):
        if target.exists():
            shutil.rmtree(earlier)
        else:
            earlier.rename(target)


def _clean(parent: Path) -> None:
    """Remove the hidden folders of programs that have ended before they were done."""
    for hidden in parent.glob(f".*{_MARK}{_RANDOM}"):
        handle = _lock(hidden)
        if handle is not None:
            shutil.rmtree(hidden, ignore_errors=True)
            os.close(handle)


def _lock(folder: Path) -> int | None:
    """Lock a folder for as long as this program lives; return its handle, None if another program holds it.

    Where the system has no locks, every folder is taken to be in use.
    """
    if sys.platform == "win32":
        return None
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(handle)
        return None
    return handle


@contextmanager
def locked(folder: Path, *, wait: bool = False) -> Iterator[None]:
    """Hold a folder, which must exist, for this program, where the system has locks.

    Results are published with the folder around them held, so that no other program finds a hidden
    folder before its owner has locked it.

    Parameters
    ----------
    wait : wait for another program that holds it

    Raises
    ------
    UsageError : another program holds it, and `wait` is false
    """
    if sys.platform == "win32":
        yield
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        with suppress(OSError):  # a file system without locks
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
            except BlockingIOError:
                raise UsageError(
                    "another program is running there", where=str(folder.parent), remedy="name another folder"
                ) from None
        yield
    finally:
        os.close(handle)


def _entries(folder: Path) -> set[str]:
    """List the names in a folder, without unfinished work and the link to the results of a run."""
    return {
        entry.name
        for entry in folder.iterdir()
        if entry.name not in _UNFINISHED_RUNS
        and not (entry.is_symlink() and os.readlink(entry).startswith(UNFINISHED))
    }


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
