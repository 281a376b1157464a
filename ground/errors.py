"""Error tree of MOMA: every foreseen failure, with its exit code.

::

    MomaError                      exit 1   anything foreseen
    ├── UsageError                 exit 2   wrong use
    │   ├── QueryError             exit 2   a query expression
    │   └── SceneError             exit 2   a scene file
    ├── SurveyError                exit 1   the contents of a survey file
    ├── GeometryError              exit 1   stones that cannot be built or closed
    ├── DatabaseError              exit 1   the entity database
    │   └── NoDatabaseError        exit 1   ... that does not exist
    ├── ExchangeError              exit 1   an exchange document
    ├── MeshError                  exit 1   a stone that cannot be meshed
    ├── StorageError               exit 1   a disk that is full, or a folder that cannot be written
    ├── UnsoundSceneError          exit 1   a scene with problems that make its result worthless
    ├── SolverError                exit 1   a step that was not solved
    └── MissingLibraryError        exit 1   a missing shared library

Each message gives the place, the fact and the remedy: ``where: what; remedy``.
"""

import errno
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Self

_HERE = ("archmodel", "ground", "mechanics", "moma", "pipelines", "survey")

_PACKAGES = {
    "PIL": "pillow",
    "skfem": "scikit-fem",
    "vtkmodules": "vtk",
    "python_calamine": "python-calamine",
}
"""Names under which pip knows modules that are called otherwise."""


class MomaError(Exception):
    """Foreseen failure, described in one line.

    Parameters
    ----------
    what : the fact, with the value found
    where : the place: ``file:line``, a stone's code, an option
    remedy : what the user can do about it
    """

    exit_code = 1

    def __init__(self, what: str, *, where: str | None = None, remedy: str | None = None) -> None:
        self.what, self.where, self.remedy = what, where, remedy
        text = what if where is None else f"{where}: {what}"
        super().__init__(text if remedy is None else f"{text}; {remedy}")

    def at(self, where: str) -> Self:
        """Return the same error at another place, known to the caller only."""
        return type(self)(self.what, where=where, remedy=self.remedy)


class UsageError(MomaError):
    """Wrong use: an option, an argument or a name."""

    exit_code = 2


class QueryError(UsageError):
    """Query expression that cannot be parsed or evaluated."""


class SceneError(UsageError):
    """Mistake in a scene file."""


class SurveyError(MomaError):
    """Mistake in the contents of a survey file."""


class GeometryError(MomaError):
    """Stone that cannot be built from its faces, or joints that cannot be closed."""


class DatabaseError(MomaError):
    """Entity database that cannot be opened, read or written."""


class NoDatabaseError(DatabaseError):
    """Missing or empty entity database."""


class ExchangeError(MomaError):
    """Exchange document that cannot be written, or is malformed."""


class MeshError(MomaError):
    """Stone that cannot be meshed."""


class StorageError(MomaError):
    """Disk that is full, or file or folder that cannot be written."""


class UnsoundSceneError(MomaError):
    """Scene that can be run, but whose result would be worthless."""


class SolverError(MomaError):
    """Time step that was not solved, where the scene makes this an error."""


class MissingLibraryError(MomaError):
    """Missing package or shared library of the system; the remedy names the package to install."""


_ELSEWHERE = "name a place that can be written"
_STORAGE = {
    errno.ENOSPC: ("the disk is full", "make room on it and try again"),
    errno.EDQUOT: ("the quota on the disk is used up", "make room and try again"),
    errno.EFBIG: (
        "a file would be larger than the system allows",
        "raise the limit (ulimit -f) and try again",
    ),
    errno.EROFS: ("the file system is read-only", _ELSEWHERE),
    errno.EACCES: ("permission denied", _ELSEWHERE),
    errno.EPERM: ("operation not permitted", _ELSEWHERE),
    errno.ENOTDIR: ("a part of the path is not a folder", _ELSEWHERE),
    errno.EISDIR: ("it is a folder", "name a file"),
    errno.ENAMETOOLONG: ("the name is too long", "give a shorter one"),
    errno.ELOOP: ("the links of the path run in a circle", _ELSEWHERE),
    errno.EIO: ("the disk reports an error", "check the disk"),
}  # by the number of the error: what is wrong, and what to do


def storage_error(error: Exception, where: str | None = None, kept: str = "") -> StorageError | None:
    """Return the error of a disk or folder that refuses to store; None if another thing has failed.

    Parameters
    ----------
    error : as the system or a library reports it; HDF5 gives its number in the text alone
    where : file or folder, where the error names none
    kept : what has not been lost
    """
    number = getattr(error, "errno", None)
    if number is None and (match := re.search(r"errno = (\d+)", str(error))) is not None:
        number = int(match[1])
    if not isinstance(error, OSError | RuntimeError) or number not in _STORAGE:
        return None
    what, remedy = _STORAGE[number]
    named = getattr(error, "filename", None)
    place = where if where is not None else None if named is None else str(named)
    return StorageError(what, where=place, remedy="; ".join(filter(None, (remedy, kept))))


def missing_library(error: BaseException) -> MissingLibraryError | None:
    """Return the error of a package that is absent or cannot be loaded; None if another thing has failed.

    >>> print(missing_library(ModuleNotFoundError("No module named 'PIL.Image'", name="PIL.Image")))
    this needs the package pillow, which is not installed; pip install pillow
    """
    module = (getattr(error, "name", None) or "").partition(".")[0]
    if not isinstance(error, ImportError) or not module or module in _HERE:
        return None
    package = _PACKAGES.get(module, module)
    if isinstance(error, ModuleNotFoundError):
        what = f"this needs the package {package}, which is not installed"
        return MissingLibraryError(what, remedy=f"pip install {package}")
    what = f"this needs the package {package}, which cannot be loaded: {error}"
    return MissingLibraryError(what, remedy=f"pip install --force-reinstall {package}")


@contextmanager
def storing(where: str, kept: str = "") -> Iterator[None]:
    """Raise `StorageError` where the file system refuses what a with-block stores; see `storage_error`."""
    try:
        yield
    except (OSError, RuntimeError) as error:
        if (refusal := storage_error(error, where, kept)) is None:
            raise
        raise refusal from error
