"""Writer of closed solids as Wavefront OBJ, one object per stone."""

from collections.abc import Sequence
from pathlib import Path

from survey.records.survey import SolidRecord


def write_obj(solids: Sequence[SolidRecord], path: Path) -> None:
    """Write solids that are read back equal to the last bit; objects are named CODE:KIND.

    Parameters
    ----------
    solids : the stones, whose courses are left out
    path : the file; it is replaced
    """
    lines, before = [], 1
    for solid in solids:
        lines.append(f"o {solid.code}:{solid.kind}")
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in solid.vertices.tolist()]
        lines += ["f " + " ".join(str(before + corner) for corner in face) for face in solid.faces]
        before += len(solid.vertices)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
