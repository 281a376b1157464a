"""A report as one page that needs no other file."""

import base64
from collections.abc import Iterable
from html import escape
from pathlib import Path

__all__ = ["figure", "page"]

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #222; max-width: 60rem; }
body { margin: 2rem auto; padding: 0 1rem; }
h1 { margin-bottom: 0; } h2 { margin-top: 2.2rem; } .lead { font-size: 1.15rem; color: #444; }
figure { margin: 1.5rem 0; } img, svg { max-width: 100%; height: auto; } figcaption { color: #555; }
table { border-collapse: collapse; }
th, td { padding: .3rem .9rem .3rem 0; text-align: left; vertical-align: top; }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.wide { overflow-x: auto; } .wide table { font-size: .85rem; }
tr + tr { border-top: 1px solid #ddd; } .warning { background: #fff3d6; padding: .6rem 1rem; }
"""


def page(title: str, body: Iterable[str]) -> str:
    """A whole HTML page around the elements of its body."""
    head = [
        '<!doctype html><html lang="en"><head><meta charset="utf-8">',
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head><body>",
    ]
    return "\n".join([*head, *body, "</body></html>"]) + "\n"


def figure(picture: Path, caption: str) -> str:
    """A PNG with its caption, the picture itself in the page."""
    content = base64.b64encode(picture.read_bytes()).decode("ascii")
    return (
        f'<figure><img alt="{escape(caption)}" src="data:image/png;base64,{content}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )
