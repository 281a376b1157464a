"""Write a sample: `python -m synthetic wall --moved settlement --out out/wall`; with `--ship`, all that are shipped.

The options are those of `moma sample`, and `--courses N` of the tower and `--pictures`, which renders photographs.
"""

import argparse
import contextlib
import json
import re
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from pipelines.samples.copy import FOLDER, SHIPPED, WrittenSample
from synthetic.granite_wall import GRANITE_WALL
from synthetic.rubble_wall import RUBBLE_WALL
from synthetic.samples import SAMPLES
from synthetic.write import write_sample

LARGE = ("tower --moved settlement",)
"""Samples of some megabytes, which are not shipped."""

NAMES = (*(name for name in SAMPLES if name not in LARGE), "window --photographs", RUBBLE_WALL, GRANITE_WALL)
"""Samples that are shipped, as they are written after `moma sample`."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m synthetic", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("kind", nargs="?")
    parser.add_argument("--moved", choices=("settlement", "thrust", "earthquake"))
    for option in ("small", "phases", "scan", "photographs", "pictures", "ship"):
        parser.add_argument(f"--{option}", action="store_true")
    parser.add_argument("--courses", type=int)
    parser.add_argument("--out", type=Path)
    return parser


def written(arguments: Sequence[str]) -> WrittenSample:
    """Write the sample that a command line names."""
    options = vars(_parser().parse_args(arguments))
    kind, out, _ = options.pop("kind"), options.pop("out"), options.pop("ship")
    return write_sample(kind, out or Path(kind), **options)


def contents(name: str) -> tuple[WrittenSample, dict[str, bytes]]:
    """Return a sample as it is shipped, with the contents of its files."""
    with tempfile.TemporaryDirectory() as place, contextlib.chdir(place):
        sample = written([*name.split(), "--out", FOLDER])
        return sample, {str(Path(file).relative_to(FOLDER)): Path(file).read_bytes() for file in sample.files}


def ship(names: Sequence[str] = NAMES) -> None:
    """Write archives of samples and the catalogue; other samples stay as they are in it."""
    file = SHIPPED / "catalogue.json"
    catalogue = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    for name in names:
        sample, files = contents(name)
        slug = re.sub(r"[ -]+", "-", name.replace("--moved ", ""))
        with ZipFile(SHIPPED / f"{slug}.zip", "w", ZIP_DEFLATED, compresslevel=9) as archive:
            for path, content in files.items():
                # no time of writing: the same files make the same archive
                archive.writestr(ZipInfo(path), content, ZIP_DEFLATED, 9)
        catalogue[name] = {
            "archive": f"{slug}.zip",
            "title": sample.title,
            "stones": sample.stones,
            "files": list(files),
            "commands": list(sample.commands),
            "synthetic": sample.synthetic,
        }
        ordered = {one: catalogue[one] for one in NAMES if one in catalogue}
        file.write_text(json.dumps(ordered, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    if "--ship" in sys.argv:
        ship()
    else:
        sample = written(sys.argv[1:])
        print(f"{sample.title}: {sample.stones} stones", *(f"  {file}" for file in sample.files), sep="\n")
        print("run it with", *(f"  {command}" for command in sample.commands), sep="\n")
