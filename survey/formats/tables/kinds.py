"""Kinds of stones by the words and abbreviations that people write for them."""

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ground.errors import UsageError
from ground.tables.columns import plain
from ground.tables.numbers import shown
from ground.tables.rows import open_rows
from survey.formats.fields import KIND

KINDS: Mapping[str, Sequence[str]] = {
    # German; French; Italian; Spanish
    "ashlar": ("Quader", "pierre de taille", "concio", "sillar", "sillería"),
    "header": ("Binder", "boutisse", "testa", "tizón"),
    "stretcher": ("Läufer", "panneresse", "fascia", "soga"),
    "quoin": ("Eckstein", "Eckquader", "pierre d'angle", "chaîne d'angle", "cantonale", "piedra angular"),
    "jamb": ("Gewände", "Gewändestein", "Laibung", "piédroit", "jambage", "stipite", "jamba"),
    "sill": ("Sohlbank", "Fensterbank", "Schwelle", "appui", "seuil", "davanzale", "soglia", "alféizar"),
    "lintel": ("Sturz", "linteau", "architrave", "dintel"),
    "voussoir": ("Wölbstein", "Bogenstein", "Keilstein", "claveau", "cuneo", "concio d'arco", "dovela"),
    "keystone": ("Schlussstein", "clef", "clé", "clef de voûte", "chiave", "chiave di volta", "clave"),
    "springer": ("Anfänger", "Kämpferstein", "sommier", "imposta", "salmer", "arranque"),
    "corbel": ("Konsole", "Kragstein", "corbeau", "mensola", "ménsula"),
    "cornice": ("Gesims", "corniche", "cornicione", "cornisa"),
    "coping": ("Abdeckstein", "couronnement", "coronamento", "albardilla"),
    "slab": ("Platte", "dalle", "lastra", "losa"),
    "capital": ("Kapitell", "chapiteau", "capitello", "capitel"),
    "base": ("Basis", "basa"),
    "shaft": ("Schaft", "fût", "fusto", "fuste"),
    "rubble": ("Bruchstein", "moellon", "pietrame", "mampuesto"),
    "infill": ("Füllung", "Hinterfüllung", "blocage", "riempimento", "relleno"),
    "support": ("Auflager", "appui fixe", "appoggio", "apoyo"),
}
"""Words for kinds in other languages."""

_WORDS = {plain(word): kind for kind, words in KINDS.items() for word in words} | {
    plain(word.replace("ä", "ae").replace("ö", "oe").replace("ü", "ue").replace("Ö", "Oe")): kind
    for kind, words in KINDS.items()
    for word in words
}


def kind_of(text: str, kinds: Mapping[str, str]) -> str:
    """Return the kind that a word stands for; the word itself, in lower case, if it is not known.

    Parameters
    ----------
    text : as in the file
    kinds : kinds by abbreviation in lower case, as the user gave them
    """
    lower = text.lower()
    return kinds.get(lower) or _WORDS.get(plain(text)) or "_".join(lower.split())


def meant(word: str, kinds: Iterable[str]) -> str:
    """Return the kind that an abbreviation stands for, with its letters in order; "ashlar" if that is not clear.

    One letter is never clear: B is Binder, boutisse or base.

    Examples
    --------
    >>> kinds = ["base", "header", "springer", "support", "voussoir"]
    >>> [meant(word, kinds) for word in ("spr", "hdr", "b", "xy")]
    ['springer', 'header', 'ashlar', 'ashlar']
    """
    letters = ".*".join(re.escape(letter) for letter in word)
    candidates = [kind for kind in kinds if len(word) > 1 and re.match(letters, kind)]
    best = max((_alike(word, kind) for kind in candidates), default=0)
    likely = [kind for kind in candidates if _alike(word, kind) == best]
    return likely[0] if len(likely) == 1 else "ashlar"


def _alike(word: str, candidate: str) -> int:
    """Return the number of letters with which both begin."""
    return next(
        (k for k, (a, b) in enumerate(zip(word, candidate, strict=False)) if a != b),
        min(len(word), len(candidate)),
    )


def read_kinds(text: str) -> Mapping[str, str]:
    """Read a table of abbreviations: ``SPR=springer,VOU=voussoir``, or a file with the two in columns.

    Raises
    ------
    UsageError
        if it is wrong
    """
    rows: list[list[str]] = []
    if "=" in text:
        rows = [[word.strip() for word in part.split("=", 1)] for part in text.split(",") if part.strip()]
    else:
        path = Path(text)
        if not path.is_file():
            raise UsageError(
                f"{shown(text)} is neither a table nor a file",
                where="--kinds",
                remedy='write e.g. --kinds "SPR=springer,VOU=voussoir", or name a file with two columns',
            )
        table = open_rows(path)
        row: Any
        for number, row in table:
            table.delimiter = table.delimiter if table.delimiter is not None else table.delimiters(row)[0]
            rows.append([cell for cell in table.cells(row, number) if cell])
        if rows and plain(rows[0][-1]) in ("kind", "art", "tipo", "genre"):
            del rows[0]
    kinds: dict[str, str] = {}
    for row in rows:
        if len(row) != 2 or not row[0] or KIND.fullmatch(row[1].lower()) is None:
            raise UsageError(
                f"{shown(' '.join(row))} is not an abbreviation and a kind",
                where="--kinds",
                remedy="write e.g. SPR=springer",
            )
        if kinds.setdefault(row[0].lower(), row[1].lower()) != row[1].lower():
            raise UsageError(f"{row[0]} stands for two kinds", where="--kinds", remedy="give it once")
    return kinds
