"""A report read as a browser reads it."""

from html.parser import HTMLParser

VOID = ("meta", "img", "link", "input", "br")
OWN = ("module", "application/json", "application/octet-stream")
"""Types of the scripts and data of the viewer."""


class Page(HTMLParser):
    """Texts of a page that closes its elements, and the addresses outside of itself that it loads from.

    Contents, menus and the viewer's script and data are no texts; `tags` has a script only if it is not the viewer's.
    """

    def __init__(self, path):
        super().__init__()
        self.open, self.sources, self.text, self.tags, self.scripts = [], [], [], set(), 0
        self.feed(path.read_text(encoding="utf-8"))
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        own = tag == "script" and dict(attributes).get("type") in OWN
        self.scripts += own
        if not own:
            self.tags.add(tag)
        if tag not in VOID:
            self.open.append(tag)
        self.sources += [
            value
            for name, value in attributes
            if name in ("src", "href") and not value.startswith("#") and value != "data:,"
        ]

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in VOID:
            self.handle_endtag(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if data.strip() and not {"script", "style", "nav", "select"} & set(self.open):
            self.text.append(data)
