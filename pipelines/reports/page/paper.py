"""Pages on paper: contents, title block with a checksum, and PDF through an installed Chromium."""

import hashlib
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from datetime import date
from pathlib import Path

from markupsafe import Markup, escape

from ground.errors import MomaError, UsageError

NO_SUM = "0" * len(hashlib.sha256().hexdigest())
"""Stands in a page where its checksum will."""

_SUM = re.compile(r'(<code class="checksum">)([0-9a-f]{64})(</code>)')
_HEADING = re.compile(r"<h2>(.*?)</h2>", re.DOTALL)
_BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge")
_PLACES = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "C:/Program Files/Google/Chrome/Application/chrome.exe",
    "C:/Program Files (x86)/Microsoft/Edge/Application/msedge.exe",
)
_PATIENCE = 120.0  # for one PDF [s]
_BY_HAND = "open report.html in a browser and print it there to PDF: A4, with background graphics"


def title_block(title: str, versions: Mapping[str, str] | str) -> Markup:
    """Return the title block of a page: building, author, date, versions, checksum.

    The author is that of the environment variable ``MOMA_AUTHOR``; without one there is room to sign.
    """
    told = (
        versions
        if isinstance(versions, str)
        else ", ".join(f"{name} {version}" for name, version in versions.items())
    )
    rows = (
        ("Building", escape(title)),
        ("Author", escape(os.environ.get("MOMA_AUTHOR", "")) or Markup("&nbsp;")),
        ("Date", escape(date.today().isoformat())),
        ("Versions", escape(told)),
        ("SHA-256", Markup('<code class="checksum">{}</code>').format(NO_SUM)),
    )
    cells = Markup("").join(Markup("<tr><th>{}</th><td>{}</td></tr>\n").format(*row) for row in rows)
    return Markup('<table class="title-block">\n{}</table>').format(cells)


def contents(page: str) -> str:
    """Put an anchor before each heading of a page, and a list of them where the page has ``<nav class="contents">``."""
    titles: list[str] = []

    def named(match: re.Match[str]) -> str:
        """Give a heading an anchor, and note its title."""
        titles.append(match[1])
        return f'<a id="part-{len(titles)}"></a><h2>{match[1]}</h2>'

    page = _HEADING.sub(named, page)
    items = "".join(
        f'<li><a href="#part-{number}">{title}</a></li>\n' for number, title in enumerate(titles, 1)
    )
    return page.replace(
        '<nav class="contents"></nav>', f'<nav class="contents">\n<ol>\n{items}</ol>\n</nav>', 1
    )


def sealed(page: str) -> str:
    """Return the page with its checksum: SHA-256 of itself in UTF-8 with 64 zeros in place of the checksum."""
    return _SUM.sub(rf"\g<1>{_digest(page)}\g<3>", page, count=1)


def check_sum(page: str) -> bool | None:
    """Return whether a page is as it was written; None if it states no checksum."""
    match = _SUM.search(page)
    return None if match is None else match[2] == _digest(_SUM.sub(rf"\g<1>{NO_SUM}\g<3>", page, count=1))


def appraise_page(page: Path) -> bool | None:
    """Return `check_sum` of a page in a file.

    Raises
    ------
    UsageError : it cannot be read
    """
    try:
        return check_sum(page.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(
            f"cannot be read: {error}", where=str(page), remedy="name a page, or a folder of results"
        ) from error


def _digest(page: str) -> str:
    return hashlib.sha256(page.encode()).hexdigest()


def print_pdf(page: Path, target: Path, language: str = "en") -> None:
    """Print a page to a PDF of A4 sheets through an installed Chromium.

    Raises
    ------
    MomaError : there is no Chromium, or it fails
    """
    browser = next((browser_path for name in _BROWSERS if (browser_path := shutil.which(name))), None)
    browser = browser or next((place for place in _PLACES if Path(place).is_file()), None)
    if browser is None:
        raise MomaError(
            "no Chromium, Chrome or Edge is installed", where="--pdf", remedy=f"install one, or {_BY_HAND}"
        )
    with tempfile.TemporaryDirectory() as folder:
        printed = Path(folder) / "page.pdf"
        command = [
            browser,
            *("--headless", "--disable-gpu", "--enable-unsafe-swiftshader", "--no-first-run"),
            "--no-pdf-header-footer",
            f"--user-data-dir={folder}/profile",
            f"--print-to-pdf={printed}",
            "--virtual-time-budget=20000",
            f"{page.absolute().as_uri()}#lang={language}",
        ]
        if hasattr(os, "geteuid") and os.geteuid() == 0:
            command.insert(1, "--no-sandbox")  # Chromium has no sandbox for root
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=_PATIENCE, check=False)
        except subprocess.TimeoutExpired as error:
            raise MomaError(
                f"{browser} did not print within {_PATIENCE:g} s", where=str(page), remedy=_BY_HAND
            ) from error
        if not printed.is_file():
            last = (done.stderr.strip().splitlines() or ["it printed nothing"])[-1]
            raise MomaError(f"{browser} failed: {last}", where=str(page), remedy=_BY_HAND)
        shutil.copyfile(printed, target)
