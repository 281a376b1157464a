"""Settings of the site, which Sphinx builds of these pages: `make site`."""

import sys
from importlib import metadata
from pathlib import Path

from pygments.lexers import TextLexer

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

project = "MOMA"
author = "The MOMA authors"
copyright = "The MOMA authors"
release = metadata.version("moma-masonry")

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["_build", "_templates", "notebooks", "examples/*.py", "**/sg_execution_times.rst"]
templates_path = ["_templates"]
nitpicky = False

myst_enable_extensions = ["attrs_inline"]
myst_heading_anchors = 4

autodoc_member_order = "bysource"
autosummary_generate = True
numpydoc_show_class_members = False

sphinx_gallery_conf = {
    "examples_dirs": ["notebooks"],
    "gallery_dirs": ["examples"],
    "filename_pattern": r"\.py$",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_memory": False,
    "min_reported_time": 600,
    "capture_repr": ("_repr_html_", "__repr__"),
}

html_theme = "pydata_sphinx_theme"
html_title = "MOMA"
html_theme_options = {"show_toc_level": 2, "navigation_with_keys": False}
html_show_sourcelink = False

# languages of blocks that nothing highlights: files of surveys and lists, what is typed, what is answered
PLAIN = ("csv", "error", "json", "kinds", "moma", "moma-head", "moma-part", "obj", "pnezd", "session")


def setup(app):
    """Show blocks in these languages as plain text."""
    for name in PLAIN:
        app.add_lexer(name, TextLexer)
