"""Optional packages, which are loaded where they are needed and name themselves where they are missing."""

from importlib import import_module
from typing import Any

from ground.errors import UsageError


def optional(module: str, what: str) -> Any:
    """Import an optional package.

    Parameters
    ----------
    module : its name
    what : the thing that it is needed for, e.g. "LAZ files"

    Raises
    ------
    UsageError
        if it is not installed, with the command that installs it
    """
    try:
        return import_module(module)
    except ImportError as error:
        raise UsageError(
            f"{what} need the package {module.split('.')[0]}, which is not installed",
            remedy="pip install 'moma-masonry[clouds]'",
        ) from error
