"""A report read as a browser reads it."""

from html.parser import HTMLParser

__all__ = ["Page"]


class Page(HTMLParser):
    """Texts of a page that closes its elements, and the addresses outside of itself that it loads from."""

    def __init__(self, path):
        super().__init__()
        self.open, self.sources, self.text, self.tags = [], [], [], set()
        self.feed(path.read_text(encoding="utf-8"))
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.tags.add(tag)
        if tag not in ("meta", "img"):
            self.open.append(tag)
        self.sources += [
            value for name, value in attributes if name in ("src", "href") and not value.startswith("#")
        ]

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in ("meta", "img"):
            self.handle_endtag(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if data.strip():
            self.text.append(data)
