"""Results of a run as a notebook shows them."""

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any


def notebook_html(folder: Path, summary: Mapping[str, Any], warnings: Sequence[str]) -> str:
    """Return headline, cautions and warnings of a run with its page in a frame, for a notebook.

    The page is within the text, so that the notebook shows it wherever it is opened.
    """
    headline = str(summary["headline"])
    cautions = "".join(f"<li>{escape(caution)}</li>" for caution in (*summary["cautions"], *warnings))
    head = f"<p><strong>{escape(headline[:1].upper() + headline[1:])}</strong></p>"
    listed = f"<ul>{cautions}</ul>" if cautions else ""
    try:
        page = (folder / "report.html").read_text(encoding="utf-8")
    except OSError:
        return f"{head}{listed}<p>There is no page in {escape(str(folder))} any more.</p>"
    frame = '<iframe sandbox="allow-scripts" style="width: 100%; height: 40em; border: 1px solid #ccc"'
    return f'{head}{listed}{frame} srcdoc="{escape(page)}"></iframe>'
