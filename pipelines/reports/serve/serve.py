"""Life of the server, from the first request to a graceful stop."""

import secrets
from collections.abc import Callable
from dataclasses import replace

from archmodel.database.session import open_database
from ground.errors import MissingLibraryError, UsageError
from pipelines.reports.serve.settings import LOCAL, Editor, ServeSettings

_FAREWELL = 5  # time for requests in progress when the server stops [s]


def serve_database(
    url: str, settings: ServeSettings, say: Callable[[str], None], editor: Editor | None = None
) -> None:
    """Serve a database until the process is told to stop (SIGINT, SIGTERM).

    Parameters
    ----------
    url : of the database
    settings : of the server
    say : called with lines for the person who started it
    editor : of outlines; the server then asks for a token, and listens on this machine alone

    Raises
    ------
    MissingLibraryError : FastAPI or uvicorn is not installed
    UsageError : outlines would be edited from elsewhere
    DatabaseError : the database cannot be opened
    """
    try:
        import uvicorn

        from pipelines.reports.serve.app import application
    except ModuleNotFoundError as error:
        raise MissingLibraryError(
            f"{error.name} is not installed", where="moma serve", remedy="pip install 'moma-masonry[serve]'"
        ) from error
    if editor is not None and settings.host not in LOCAL:
        what = f"{settings.host} can be reached from outside"
        raise UsageError(what, where="--edit", remedy="leave --host out: outlines are edited on this machine")
    if editor is not None and settings.token is None:
        settings = replace(settings, token=secrets.token_urlsafe())
    with open_database(url, create=editor is not None) as database:
        app = application(database, settings, editor)
        if settings.host not in LOCAL and settings.token is None:
            say(f"warning: {settings.host} can be reached from outside, by anybody; --token asks for a token")
        address = f"http://{settings.host}:{settings.port}"
        say(f"serving {database.home.place} on {address}{'' if editor else ', read only'}; Ctrl-C stops")
        if editor is not None:
            say(f"  outlines: {address}/outlines?token={settings.token}")
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
