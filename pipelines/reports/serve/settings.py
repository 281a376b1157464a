"""Settings of the server."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

LOCAL = ("127.0.0.1", "localhost", "::1")
"""Names of this machine for itself."""


class Editor(Protocol):
    """Page that a person edits, and what becomes of a save."""

    def page(self) -> str:
        """Return the page as HTML; it posts to ``outlines``."""

    def save(self, content: bytes) -> Mapping[str, Any]:
        """Take in what the page posts, and return what was done, with its words under "text"."""


@dataclass(frozen=True)
class ServeSettings:
    """Settings of `moma serve`.

    Attributes
    ----------
    host, port : to listen on
    token : asked of every request; None: none
    seconds : longest time of one query [s]
    rows : most rows of one answer, and stones of one view
    at_once : questions that the database answers at a time; others wait
    patience : longest time that they wait [s]
    """

    host: str = "127.0.0.1"
    port: int = 8000
    token: str | None = None
    seconds: float = 5.0
    rows: int = 10_000
    at_once: int = 4
    patience: float = 60.0

    @property
    def hosts(self) -> list[str]:
        """Names by which a request may call the server; any, where it listens on all addresses."""
        if self.host in ("0.0.0.0", "::"):
            return ["*"]
        return sorted({*LOCAL, "[::1]", self.host})
