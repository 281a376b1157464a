"""Life of the server, from the first request to a graceful stop."""

from collections.abc import Callable

from archmodel.database.session import open_database
from ground.errors import MissingLibraryError
from pipelines.reports.serve.settings import LOCAL, ServeSettings

__all__ = ["serve_database"]

_FAREWELL = 5  # time for requests in progress when the server stops [s]


def serve_database(url: str, settings: ServeSettings, say: Callable[[str], None]) -> None:
    """Serve a database until the process is told to stop (SIGINT, SIGTERM).

    Parameters
    ----------
    url : of the database
    settings : of the server
    say : called with lines for the person who started it

    Raises
    ------
    MissingLibraryError : FastAPI or uvicorn is not installed
    DatabaseError : the database cannot be opened
    """
    try:
        import uvicorn

        from pipelines.reports.serve.app import application
    except ModuleNotFoundError as error:
        raise MissingLibraryError(
            f"{error.name} is not installed", where="moma serve", remedy="pip install 'moma-masonry[serve]'"
        ) from error
    with open_database(url, create=False) as database:
        app = application(database, settings)
        if settings.host not in LOCAL and settings.token is None:
            say(f"warning: {settings.host} can be reached from outside, by anybody; --token asks for a token")
        say(
            f"serving {database.home.place} on http://{settings.host}:{settings.port}, read only; Ctrl-C stops"
        )
        uvicorn.run(
            app,
            host=settings.host,
            port=settings.port,
            log_level="warning",
            access_log=False,
            server_header=False,
            timeout_graceful_shutdown=_FAREWELL,
            limit_concurrency=500,
        )
