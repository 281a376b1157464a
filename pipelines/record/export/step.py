"""STEP text (ISO 10303-21): numbered instances, and values as it writes them."""

import io
from collections.abc import Iterable
from datetime import datetime


def text(value: str | None) -> str:
    """Return a text as STEP writes it: ASCII, all other characters as code points.

    >>> text("it's für"), text(None)
    ("'it''s f\\\\X2\\\\00FC\\\\X0\\\\r'", '$')
    """
    if value is None:
        return "$"
    if value.isascii() and value.isprintable():
        return "'" + value.replace("\\", "\\\\").replace("'", "''") + "'"
    return "'" + "".join(_character(character) for character in value) + "'"


def _character(character: str) -> str:
    code = ord(character)
    if character in "'\\":
        return 2 * character
    if 32 <= code < 127:
        return character
    return f"\\X2\\{code:04X}\\X0\\" if code < 0x10000 else f"\\X4\\{code:08X}\\X0\\"


def real(value: float) -> str:
    """Return a number with the digits that give the same float64 back.

    >>> real(2.0), real(1e-7), real(-0.25)
    ('2.', '1.E-07', '-0.25')
    """
    digits = repr(float(value)).upper()
    if "E" in digits:
        head, _, power = digits.partition("E")
        return f"{head}{'' if '.' in head else '.'}E{power}"
    return digits[:-1] if digits.endswith(".0") else digits


def enumeration(name: str) -> str:
    """Return a member of an enumeration."""
    return f".{name}."


def list_of(values: Iterable[str]) -> str:
    """Return a list of values that are written already."""
    return f"({','.join(values)})"


def triples(rows: Iterable[Iterable[float]]) -> str:
    """Return a list of lists of numbers."""
    return list_of(list_of(map(real, row)) for row in rows)


class StepFile:
    """A file in the making.

    Parameters
    ----------
    schema : of its instances, e.g. "IFC4"
    title : of the file
    date : of its contents
    program : that writes it, with its version
    """

    def __init__(self, schema: str, title: str, date: datetime, program: str, view: str) -> None:
        head = [
            "ISO-10303-21;",
            "HEADER;",
            f"FILE_DESCRIPTION(({text(view)}),'2;1');",
            f"FILE_NAME({text(title)},{text(date.strftime('%Y-%m-%dT%H:%M:%S'))},(''),(''),"
            f"{text(program)},{text(program)},'');",
            f"FILE_SCHEMA(({text(schema)}));",
            "ENDSEC;",
            "DATA;",
        ]
        self._written = io.BytesIO()  # a list of lines would take twice the memory
        self._written.write("\n".join([*head, ""]).encode("ascii"))
        self._count = 0

    def add(self, kind: str, *values: str) -> str:
        """Add an instance, and return the reference to it."""
        self._count += 1
        self._written.write(f"#{self._count}={kind}({','.join(values)});\n".encode("ascii"))
        return f"#{self._count}"

    def content(self) -> bytes:
        """End the file, and return the whole of it."""
        self._written.write(b"ENDSEC;\nEND-ISO-10303-21;\n")
        return self._written.getvalue()
