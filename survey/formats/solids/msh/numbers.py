"""Numbers of a Gmsh MSH file, section by section, from text or binary."""

import re

import numpy as np

from ground.errors import SurveyError
from ground.tables.numbers import shown
from survey.arrays import Array, Ints

_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII).fullmatch
_REMEDY = "export MSH 2.2 or 4.1"


class MshNumbers:
    """Reader of the numbers of a file in sequence.

    Parameters
    ----------
    data : the file
    path : its name, for errors

    Attributes
    ----------
    binary : whether the file is binary
    version : "2.2" or "4.1"
    """

    def __init__(self, data: bytes, path: str) -> None:
        self._data, self._path, self._at = data, path, 0
        self.binary, self._order = False, "<"
        self._words: list[bytes] = []
        self._word = 0
        self.version = ""
        if self.section() != "MeshFormat":
            raise self.fail("this is not a gmsh mesh")
        head = self._line().split()
        if (
            len(head) != 3
            or head[0] not in (b"2.2", b"4.1")
            or head[1] not in (b"0", b"1")
            or head[2] != b"8"
        ):
            raise self.fail(f"format {shown(b' '.join(head).decode('latin-1'))} of a gmsh mesh")
        self.version, self.binary = head[0].decode(), head[1] == b"1"
        if self.binary:
            marker = data[self._at : self._at + 4]
            if marker not in (b"\x01\0\0\0", b"\0\0\0\x01"):
                raise self.fail("the byte order cannot be read")
            self._order = "<" if marker[0] else ">"
            self._at += 4
        self.end("MeshFormat")

    def fail(self, what: str, remedy: str = _REMEDY) -> SurveyError:
        """Make an error; of a text file with the current line."""
        line = self._data.count(b"\n", 0, min(self._at, len(self._data))) + 1
        return SurveyError(what, where=self._path if self.binary else f"{self._path}:{line}", remedy=remedy)

    def section(self) -> str | None:
        """Return the name of the next section; None at the end of the file."""
        while self._at < len(self._data):
            line = self._line().strip()
            if line.startswith(b"$"):
                name = line[1:].decode("latin-1")
                if not self.binary and self.version and name in ("Nodes", "Elements", "Entities"):
                    self._split(name)
                return name
            if line:
                raise self.fail(f"{shown(line.decode('latin-1'))} where a section should begin")
        return None

    def text(self, name: str) -> list[str]:
        """Return all lines of a section, up to its end."""
        stop = self._data.find(b"$End" + name.encode("latin-1"), self._at)
        if stop < 0:
            raise self.fail(f"section {shown(name)} has no end")
        text = self._data[self._at : stop].decode("utf-8", "replace")
        self._at = stop
        if name != "PhysicalNames":
            self.end(name)
        return [line for line in text.splitlines() if line.strip()]

    def end(self, name: str) -> None:
        """Check that the section ends here."""
        if self._word < len(self._words):
            raise self.fail(f"section {name} has more numbers than it states")
        self._words, self._word = [], 0
        while self._at < len(self._data):
            line = self._line().strip()
            if line == b"$End" + name.encode("latin-1"):
                return
            if line:
                break
        raise self.fail(f"section {shown(name)} does not end where it should")

    def plausible(self, count: int) -> int:
        """Check a count of things that take a byte each at least."""
        if not 0 <= count <= len(self._data):
            raise self.fail(f"a count of {count}")
        return count

    def sizes(self, count: int) -> Ints:
        """Read numbers of things."""
        return self._take(count, "i8").astype(np.int64)

    def size(self) -> int:
        """Read one number of things."""
        return int(self.sizes(1)[0])

    def counts(self, count: int) -> Ints:
        """Read numbers that are text even in binary files of format 2.2."""
        if not self.binary:
            return self._take(count, "i8").astype(np.int64)
        line = self._line().strip()
        if not line.isdigit() or len(line) > 15:
            raise self.fail(f"{shown(line.decode('latin-1'))} is not a count")
        return np.array([int(line)])

    def integers(self, count: int) -> Ints:
        """Read whole numbers."""
        return self._take(count, "i4").astype(np.int64)

    def reals(self, count: int) -> Array:
        """Read numbers."""
        return self._take(count, "f8").astype(np.float64)

    def records(self, count: int) -> tuple[Ints, Array]:
        """Read the nodes of format 2.2: a number and three coordinates each."""
        if not self.binary:
            rows = self.reals(4 * self.plausible(count)).reshape(-1, 4)
            if not (np.abs(rows[:, 0]) < 2.0**53).all():
                raise self.fail("a node without a number")
            return rows[:, 0].astype(np.int64), rows[:, 1:]
        form = np.dtype([("tag", f"{self._order}i4"), ("place", f"{self._order}f8", 3)])
        records = np.frombuffer(self._bytes(count * form.itemsize), dtype=form)
        return records["tag"].astype(np.int64), records["place"].astype(np.float64)

    def element_head(self) -> tuple[int, int, int]:
        """Read the type, the number and the number of tags of a block of elements of format 2.2."""
        if self.binary:
            kind, count, tags = self.integers(3).tolist()
            return kind, count, tags
        _, kind, tags = self.integers(3).tolist()
        return kind, 1, tags

    def _line(self) -> bytes:
        stop = self._data.find(b"\n", self._at) + 1 or len(self._data)
        line, self._at = self._data[self._at : stop], stop
        return line

    def _split(self, name: str) -> None:
        """Split a section of a text file into words."""
        stop = self._data.find(b"$End" + name.encode(), self._at)
        if stop < 0:
            raise self.fail(f"section {name} has no end")
        for line in self._data[self._at : stop].split(b"\n"):
            words = line.split()
            for word in words:
                if _NUMBER(word.decode("latin-1")) is None:
                    raise self.fail(f"{shown(word.decode('latin-1'))} is not a number")
            self._words += words
            self._at += len(line) + 1
        self._at = stop

    def _take(self, count: int, kind: str) -> Array | Ints:
        if count < 0:
            raise self.fail(f"a count of {count}")
        if self.binary:
            return np.frombuffer(self._bytes(count * int(kind[1])), dtype=self._order + kind)
        words = self._words[self._word : self._word + count]
        if len(words) < count:
            raise self.fail("the section has fewer numbers than it states")
        self._word += count
        try:
            return np.array([float(word) if kind == "f8" else int(word) for word in words], dtype=kind)
        except (ValueError, OverflowError) as error:
            raise self.fail("a number that is not whole, or too large") from error

    def _bytes(self, size: int) -> bytes:
        out = self._data[self._at : self._at + size]
        if len(out) < size:
            raise self.fail("the file is cut short")
        self._at += size
        return out
