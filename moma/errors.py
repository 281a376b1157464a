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
    ├── UnsoundSceneError          exit 1   a scene with problems that make its result worthless
    ├── SolverError                exit 1   a step that was not solved
    └── MissingLibraryError        exit 1   a missing shared library

Each message gives the place, the fact and the remedy: ``where: what; remedy``.
"""

from typing import Self

__all__ = [
    "DatabaseError",
    "ExchangeError",
    "GeometryError",
    "MeshError",
    "MissingLibraryError",
    "MomaError",
    "NoDatabaseError",
    "QueryError",
    "SceneError",
    "SolverError",
    "SurveyError",
    "UnsoundSceneError",
    "UsageError",
]


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


class UnsoundSceneError(MomaError):
    """Scene that can be run, but whose result would be worthless."""


class SolverError(MomaError):
    """Time step that was not solved, where the scene makes this an error."""


class MissingLibraryError(MomaError):
    """Missing shared library of the system; the remedy names the package to install."""
