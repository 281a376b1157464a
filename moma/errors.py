"""The error tree: every failure that MOMA foresees, and its exit code.

::

    MomaError                      exit 1   anything foreseen
    ├── UsageError                 exit 2   what the user asked for is wrong
    │   ├── QueryError             exit 2   a query expression
    │   └── SceneError             exit 2   a scene file
    ├── SurveyError                exit 1   the contents of a survey file
    ├── GeometryError              exit 1   stones that cannot be built or closed
    ├── DatabaseError              exit 1   the entity database
    │   └── NoDatabaseError        exit 1   ... of which there is none at that place
    ├── ExchangeError              exit 1   a building as one document
    ├── MeshError                  exit 1   a stone that cannot be meshed
    ├── SolverError                exit 1   a step that was not solved
    └── MissingLibraryError        exit 1   a shared library of the system is absent

Each error says what is wrong, where, and what to do: ``where: what; remedy``.
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
    "UsageError",
]


class MomaError(Exception):
    """A failure that MOMA foresees, in one line.

    Parameters
    ----------
    what : the fact, with the value that was found
    where : the place: ``file:line``, a stone's code, an option
    remedy : what the user can do about it
    """

    exit_code = 1

    def __init__(self, what: str, *, where: str | None = None, remedy: str | None = None) -> None:
        self.what, self.where, self.remedy = what, where, remedy
        text = what if where is None else f"{where}: {what}"
        super().__init__(text if remedy is None else f"{text}; {remedy}")

    def at(self, where: str) -> Self:
        """The same failure at another place, as only the caller knows it."""
        return type(self)(self.what, where=where, remedy=self.remedy)


class UsageError(MomaError):
    """What the user asked for is wrong: an option, an argument, a name."""

    exit_code = 2


class QueryError(UsageError):
    """A query expression cannot be understood."""


class SceneError(UsageError):
    """A scene file is wrong."""


class SurveyError(MomaError):
    """The contents of a survey file are wrong."""


class GeometryError(MomaError):
    """A stone cannot be built from its faces, or its joints cannot be closed."""


class DatabaseError(MomaError):
    """The entity database cannot be opened, read or written."""


class NoDatabaseError(DatabaseError):
    """There is no database at the place that was named, or an empty one."""


class ExchangeError(MomaError):
    """A document that holds a whole building cannot be written, or is not what it should be."""


class MeshError(MomaError):
    """A stone cannot be meshed."""


class SolverError(MomaError):
    """A time step was not solved, and the scene asked for that to be an error."""


class MissingLibraryError(MomaError):
    """A shared library of the system is absent; the remedy names the package to install."""
