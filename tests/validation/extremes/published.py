"""The matrix as docs/accuracy.md publishes it."""

from collections.abc import Mapping

_TITLE = "## 14. Extremes"


def published(page: str) -> Mapping[tuple[str, str], Mapping[str, str]]:
    """Text of each cell by row (group, name) and method, from the text of docs/accuracy.md."""
    section = page.split(_TITLE, 1)[1].split("\n## ", 1)[0]
    found: dict[tuple[str, str], Mapping[str, str]] = {}
    methods: list[str] = []
    for line in section.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("| extreme |"):
            methods = cells[2:]
        elif line.startswith("| ") and not line.startswith("| ---") and methods:
            found[cells[0], cells[1]] = dict(zip(methods, cells[2:], strict=True))
        elif not line.startswith("|"):
            methods = []
    return found
