"""Files that documents name: looked for beside the file of knowledge, and hashed."""

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pipelines.record.file import Table

_LOCAL = re.compile(r"(?!\w+://).*\.[A-Za-z]\w{1,4}")
"""A place that ends as names of files do, and is no address: an archive's number is none."""


@dataclass(frozen=True)
class Attachment:
    """File that a document names as its place.

    Attributes
    ----------
    document : code of the document
    place : as it is written
    sha256 : of the file's bytes, in hexadecimal; None if there is no such file here
    """

    document: str
    place: str
    sha256: str | None

    def values(self) -> Mapping[str, str | None]:
        """Return what an entry keeps of it."""
        return {"place": self.place, "sha256": self.sha256}


def attachment_of(table: Table, folder: Path) -> Attachment | None:
    """Find the file that a [[document]] names; None where its place is no path.

    Parameters
    ----------
    folder : of the file of knowledge, from which relative paths start
    """
    place = table.values.get("place") if table.name == "document" else None
    if place is None or not _LOCAL.fullmatch(place):
        return None
    file = folder / place
    sha256 = None
    if file.is_file():
        with file.open("rb") as stream:
            sha256 = hashlib.file_digest(stream, "sha256").hexdigest()
    return Attachment(table.values["code"], place, sha256)
