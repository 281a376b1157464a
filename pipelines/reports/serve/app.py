"""The application: its routes, its limits, and what every response carries."""

import base64
import hashlib
import hmac
import re
import threading
from collections.abc import Awaitable, Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from importlib.metadata import version
from typing import Annotated, Any

from fastapi import FastAPI, HTTPException, Query, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.responses import HTMLResponse, JSONResponse, PlainTextResponse
from sqlalchemy.orm import Session
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException as StarletteHTTPException
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from archmodel.database.as_known import EarlierStates, entry_named
from archmodel.database.limits import deadline
from archmodel.database.session import Database
from archmodel.describe.entity import describe
from archmodel.describe.history import history
from archmodel.describe.runs import describe_run, list_runs
from archmodel.describe.schema_tree import schema
from archmodel.tables.entries import latest_entry
from ground.errors import DatabaseError, MomaError, UsageError
from pipelines.reports.html import render
from pipelines.reports.serve.answers import COLUMNS, Answers
from pipelines.reports.serve.settings import Editor, ServeSettings

_LONGEST = 2000  # characters of an expression
_MOST = 20  # expressions
_SCRIPTS = re.compile(r'<script(?: type="module")?>(.*?)</script>', re.DOTALL)
_STYLES = re.compile(r"<style>(.*?)</style>", re.DOTALL)
_COOKIE = "moma_token"
_EDITED = "/outlines"
_HEAVIEST = 100_000_000  # bytes of a save: 5,000 outlines take two million

Kind = Annotated[str, Query(max_length=100, description="Kind of entity, with its subkinds.")]
Where = Annotated[
    tuple[Annotated[str, Query(max_length=_LONGEST)], ...],
    Query(max_length=_MOST, description="Conditions; all must hold."),
]
Run = Annotated[int | None, Query(ge=1, le=2**31 - 1, description="Run whose results are meant.")]
When = Annotated[
    str | None, Query(max_length=20, description="As it was known then: a date, or the number of an entry.")
]
Columns = Annotated[str | None, Query(max_length=_LONGEST, description="Attributes, separated by commas.")]
Format = Annotated[str, Query(pattern="^(html|json|csv|geojson)$")]
Page = Annotated[str, Query(pattern="^(html|json)$")]


def application(database: Database, settings: ServeSettings, editor: Editor | None = None) -> FastAPI:
    """Return the application that serves a database; without an editor it reads, and nothing else.

    Parameters
    ----------
    database : open
    settings : limits and token
    editor : of outlines, at ``/outlines``
    """
    app = FastAPI(
        title="MOMA",
        version=version("moma-masonry"),
        summary="An architectural database of masonry",
        docs_url=None,
        redoc_url=None,
    )
    answers, room = Answers(settings.rows), threading.Semaphore(settings.at_once)
    earlier = EarlierStates(settings.at_once)
    _refusals(app)
    _guards(app, settings, editor is not None)
    if editor is not None:
        _edits(app, editor)

    @contextmanager
    def asking(at: str | None = None) -> Iterator[Session]:
        """Give a session that reads, for a limited time, of now or of an earlier state."""
        if not room.acquire(timeout=settings.patience):
            raise HTTPException(503, "Too many questions at once; try again.", {"Retry-After": "5"})
        try:
            with ExitStack() as stack:
                session = stack.enter_context(database.session(read_only=True))
                limit = stack.enter_context(deadline(session, settings.seconds))
                try:
                    if at:
                        session = stack.enter_context(earlier.as_known(session, entry_named(session, at)))
                        limit = stack.enter_context(deadline(session, settings.seconds))
                    yield session
                except Exception as error:
                    if limit.stopped(error):
                        told = f"The query took longer than {settings.seconds:g} s and was stopped."
                        raise HTTPException(503, told) from error
                    raise
        finally:
            room.release()

    @app.get("/", response_class=HTMLResponse)
    def home() -> Response:
        """Show what the database holds."""
        with asking() as session:
            return _page("home.html", **answers.home(session, database.home.place))

    @app.get("/query")
    def query(
        kind: Kind = "entity",
        where: Where = (),
        columns: Columns = None,
        run: Run = None,
        at: When = None,
        format: Format = "html",
    ) -> Response:
        """Answer a query as a page, JSON, CSV or GeoJSON."""
        asked = tuple(one for one in where if one.strip())
        names = (
            COLUMNS if columns is None else tuple(one.strip() for one in columns.split(",") if one.strip())
        )
        with asking(at) as session:
            if format == "geojson":
                return JSONResponse(
                    answers.geojson(session, kind, asked, run, names), media_type="application/geo+json"
                )
            rows, more = answers.rows(session, kind, asked, run, names)
        if format == "csv":
            return _download(answers.csv(names, rows), "text/csv; charset=utf-8", "entities.csv")
        if format == "json":
            return JSONResponse({"rows": rows, "truncated": more})
        return _page(
            "query.html",
            kind=kind,
            where=asked,
            run=run,
            at=at,
            columns=names,
            rows=rows,
            more=more,
            limit=settings.rows,
        )

    @app.get("/entity/{code:path}")
    def entity(code: str, at: When = None, format: Page = "html") -> Response:
        """Show an entity with its history."""
        with asking(at) as session:
            told = describe(session, code)
            events = [asdict(event) for event in history(session, code)]
        if format == "json":
            return JSONResponse({**told, "history": events})
        return _page("entity.html", code=code, told=told, events=events)

    @app.get("/runs")
    def runs(format: Page = "html") -> Response:
        """List all runs."""
        with asking() as session:
            found = list_runs(session)
        return JSONResponse(found) if format == "json" else _page("runs.html", runs=found)

    @app.get("/runs/{number}")
    def run(number: int, format: Page = "html") -> Response:
        """Show a run."""
        if not 1 <= number < 2**31:
            raise HTTPException(404, "There is no such run.")
        with asking() as session:
            told = describe_run(session, number)
        return JSONResponse(told) if format == "json" else _page("run_record.html", number=number, told=told)

    @app.get("/schema")
    def kinds(format: Page = "html") -> Response:
        """Show all kinds and attributes."""
        with asking() as session:
            tree = schema(session)
        return JSONResponse(tree) if format == "json" else _page("told.html", title="Schema", told=tree)

    @app.get("/view", response_class=HTMLResponse)
    def view(kind: Kind = "entity", where: Where = (), run: Run = None, at: When = None) -> Response:
        """Show the stones that a query finds, to turn."""
        asked = tuple(one for one in where if one.strip())
        with asking(at) as session:
            text = answers.view(session, latest_entry(session), kind, asked, run, dated=bool(at))
        return HTMLResponse(text, headers={"Content-Security-Policy": _policy(text)})

    @app.get("/stones.glb")
    def glb(kind: Kind = "entity", where: Where = (), run: Run = None) -> Response:
        """Return the stones that a query finds as a file of glTF."""
        asked = tuple(one for one in where if one.strip())
        with asking() as session:
            data = answers.glb(session, kind, asked, run)
        return _download(data, "model/gltf-binary", "stones.glb")

    return app


def _edits(app: FastAPI, editor: Editor) -> None:
    """Add the page of outlines, and the way by which it saves."""

    @app.get(_EDITED, response_class=HTMLResponse)
    def outlines() -> Response:
        """Show the editor of outlines."""
        text = editor.page()
        policy = _policy(text).replace("default-src 'none';", "default-src 'none'; connect-src 'self';")
        return HTMLResponse(text, headers={"Content-Security-Policy": policy})

    @app.post(_EDITED)
    async def save(request: Request) -> Response:
        """Save outlines of the editor."""
        content = bytearray()
        async for part in request.stream():
            content += part
            if len(content) > _HEAVIEST:
                raise HTTPException(413, "These outlines are too many for one save.")
        return JSONResponse(await run_in_threadpool(editor.save, bytes(content)))


def _page(template: str, **values: Any) -> Response:
    text = render(f"serve/{template}", version=version("moma-masonry"), **values)
    return HTMLResponse(text, headers={"Content-Security-Policy": _policy(text)})


def _download(content: str | bytes, media: str, name: str) -> Response:
    return Response(
        content, media_type=media, headers={"Content-Disposition": f'attachment; filename="{name}"'}
    )


def _policy(page: str) -> str:
    """Return the content security policy of a page: its own script and style by their hashes, nothing else."""

    def hashes(found: list[str]) -> str:
        """Return the hashes of scripts or styles."""
        sums = (base64.b64encode(hashlib.sha256(one.encode()).digest()).decode() for one in found)
        return " ".join(f"'sha256-{one}'" for one in sums) or "'none'"

    return (
        f"default-src 'none'; script-src {hashes(_SCRIPTS.findall(page))}; style-src {hashes(_STYLES.findall(page))}; "
        "img-src data: blob:; form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
    )


def _refusals(app: FastAPI) -> None:
    """Answer foreseen failures with their words, none with a trace."""

    @app.exception_handler(MomaError)
    def moma_error(request: Request, error: MomaError) -> Response:
        """Answer an error of ours with its words."""
        missing = isinstance(error, UsageError) and error.what.startswith(("there is no ", "no "))
        status = 404 if missing else 400 if isinstance(error, UsageError) else 503
        return _refusal(request, status, str(error) if not isinstance(error, DatabaseError) else error.what)

    @app.exception_handler(StarletteHTTPException)
    def http_error(request: Request, error: StarletteHTTPException) -> Response:
        """Answer an error of the protocol with its words."""
        return _refusal(request, error.status_code, str(error.detail), error.headers)

    @app.exception_handler(RequestValidationError)
    def wrong_request(request: Request, error: RequestValidationError) -> Response:
        """Answer a request that is not understood with what is wrong."""
        told = "; ".join(f"{one['loc'][-1]}: {one['msg']}" for one in error.errors())
        return _refusal(request, 422, told)


def _refusal(request: Request, status: int, told: str, headers: Any = None) -> Response:
    if "text/html" not in request.headers.get("accept", ""):
        return JSONResponse({"error": told}, status, headers)
    text = render("serve/refusal.html", version=version("moma-masonry"), status=status, told=told)
    return HTMLResponse(text, status, {**dict(headers or {}), "Content-Security-Policy": _policy(text)})


def _guards(app: FastAPI, settings: ServeSettings, edits: bool) -> None:
    """Ask for the token, and add the headers that every response carries."""

    @app.middleware("http")
    async def guarded(request: Request, answer: Callable[[Request], Awaitable[Response]]) -> Response:
        """Answer a request if it only reads, or saves outlines, and has the token."""
        given = _given(request)
        allowed = settings.token is None or hmac.compare_digest(given.encode(), settings.token.encode())
        posted = edits and request.method == "POST" and request.url.path == _EDITED
        if request.method != "GET" and not posted:
            response: Response = PlainTextResponse("read only\n", 405, {"Allow": "GET, HEAD"})
        elif not allowed:
            response = PlainTextResponse("a token is needed\n", 401, {"WWW-Authenticate": "Bearer"})
        else:
            response = await answer(request)
            if settings.token is not None and "token" in request.query_params:
                response.set_cookie(_COOKIE, settings.token, httponly=True, samesite="strict")
        for name, value in (
            ("Content-Security-Policy", "default-src 'none'; frame-ancestors 'none'"),
            ("X-Content-Type-Options", "nosniff"),
            ("X-Frame-Options", "DENY"),
            ("Referrer-Policy", "no-referrer"),
            ("Cross-Origin-Resource-Policy", "same-origin"),
            ("Cross-Origin-Opener-Policy", "same-origin"),
            ("Permissions-Policy", "camera=(), geolocation=(), microphone=()"),
            ("Cache-Control", "no-store"),
        ):
            response.headers.setdefault(name, value)
        return response

    app.add_middleware(TrustedHostMiddleware, allowed_hosts=settings.hosts)
    app.add_middleware(_Heads)


class _Heads:
    """Middleware that answers HEAD as GET, with the same status and headers, without a body."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, a HEAD as a GET."""
        if scope["type"] != "http" or scope["method"] != "HEAD":
            await self._app(scope, receive, send)
            return

        async def without_body(message: Message) -> None:
            """Pass a message on without its content."""
            await send({**message, "body": b""} if message["type"] == "http.response.body" else message)

        await self._app({**scope, "method": "GET"}, receive, without_body)


def _given(request: Request) -> str:
    """Return the token of a request: bearer, of the address, or of its cookie."""
    head = request.headers.get("authorization", "")
    if head.lower().startswith("bearer "):
        return head[7:].strip()
    return request.query_params.get("token") or request.cookies.get(_COOKIE, "")
