"""Scene with the best hypothesis, written with the files that it names, so that it runs where it lies."""

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pipelines.assess.diagnosis.file import DiagnosisFile
from pipelines.assess.diagnosis.ranking import Ranked
from pipelines.assess.diagnosis.search import Case
from pipelines.toml.writer import toml_text

__all__ = ["BEST", "write_best"]

BEST = "best.toml"
"""Name of the scene."""

_RECORDS = ("x", "y", "z")  # keys of a ground motion that name files


def write_best(folder: Path, file: DiagnosisFile, case: Case, best: Ranked) -> None:
    """Write the scene with the best hypothesis, and copies of the records and tables that it names.

    Parameters
    ----------
    folder : that is empty of files of these names
    file : for the place of the scene, beside which they lie
    case, best : the hypothesis, and its amplitudes
    """
    copies = _Copies(Path(file.scene_path).parent, folder)
    scene = copies.named(case.scene(file, best.fit.amplitudes))
    heading = f"# {best.title}: the amplitudes that explain best\n"
    if file.from_rest:
        heading += "# Movements were counted from where the scene rests without this cause.\n"
    (folder / BEST).write_text(heading + toml_text(scene), encoding="utf-8")


class _Copies:
    """Copies of the files that a scene names, each under a name of its own.

    Parameters
    ----------
    source : folder of the scene
    target : of the copies
    """

    def __init__(self, source: Path, target: Path) -> None:
        self._source, self._target = source, target
        self._names: dict[Path, str] = {}

    def named(self, part: Any) -> Any:
        """Return part of a scene with the names of the copies."""
        if isinstance(part, list):
            return [self.named(one) for one in part]
        if not isinstance(part, Mapping):
            return part
        names = _RECORDS if part.get("type") == "ground_motion" else ("file",)
        return {
            key: self._copied(one) if key in names and isinstance(one, str) else self.named(one)
            for key, one in part.items()
        }

    def _copied(self, name: str) -> str:
        path = (self._source / name).resolve()
        if path not in self._names:
            own, number = path.name, 1
            while own in self._names.values() or (self._target / own).exists():
                number += 1
                own = f"{path.stem}-{number}{path.suffix}"
            shutil.copyfile(path, self._target / own)
            self._names[path] = own
        return self._names[path]
