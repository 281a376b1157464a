"""A block on the ground, as a survey, a scene and a study."""

from itertools import pairwise
from pathlib import Path

import moma

HEIGHT, DEPTH, FRICTION = 1.0, 0.36, 0.35

SURVEY = """moma-survey 1
name block
observer 0 -5 1
depth ashlar {depth} sigma 0.02 source assumed
sigma 0.001

stone GROUND ashlar course 1
  depth 1.0 sigma 0.001 source dug out
  vertex -0.6 0 -0.3
  vertex 0.6 0 -0.3
  vertex 0.6 0 0
  vertex -0.6 0 0
end
stone BLOCK ashlar course 2
  vertex -0.25 0 0
  vertex 0.25 0 0
  vertex 0.25 0 1
  vertex -0.25 0 1
end
"""

SCENE = """[scene]
name = "block"
[select]
kind = "ashlar"
[materials.stone]
density = 2000.0
young = 1e10
poisson = 0.2
[bodies]
default = "rigid"
fixed = ["course = 1"]
[contact]
friction = 0.35
"""

HEAD = '[study]\nscene = "block.toml"\nmethod = "{method}"\nsamples = {samples}\n'
BOUND = '[[quantities]]\ntype = "bound"\nload = "horizontal y"\nfails_below = 0.30\n'
FRICTIONAL = '[[inputs]]\ntype = "friction"\nsigma = 0.03\n'
DEEP = '[[inputs]]\ntype = "depth"\nstones = ["BLOCK"]\nsigma = 0.02\n'


def block_survey(folder: Path) -> str:
    """Write survey and scene of a block; take it into a database and return its URL."""
    (folder / "block.moma").write_text(SURVEY.format(depth=DEPTH), encoding="utf-8")
    (folder / "block.toml").write_text(SCENE, encoding="utf-8")
    url = f"sqlite:///{folder / 'block.db'}"
    moma.ingest([str(folder / "block.moma")], url)
    return url


def study_file(folder: Path, method: str, *tables: str, samples: int = 40) -> Path:
    """Write a study of the block."""
    path = folder / "study.toml"
    path.write_text(HEAD.format(method=method, samples=samples) + "".join(tables), encoding="utf-8")
    return path


def leaf_survey(folder: Path, courses: int = 8) -> str:
    """Write survey and scene of a leaf of stones of 0.5 × 0.25 m, four a course in running bond, on the ground."""
    lines = ["moma-survey 1", "name leaf", "observer 1 -5 1", "depth stretcher 0.4 sigma 0.03 source assumed"]
    lines += ["depth header 1.2 sigma 0.01 source dug out", "sigma 0.001", ""]
    lines += _stone("GROUND", "header", 1, (-0.1, 2.1), (-0.3, 0.0))
    for course in range(courses):
        ends = [0.0, 0.5, 1.0, 1.5, 2.0] if course % 2 == 0 else [0.0, 0.25, 0.75, 1.25, 1.75, 2.0]
        for number, span in enumerate(pairwise(ends)):
            height = (0.25 * course, 0.25 * (course + 1))
            lines += _stone(f"S{course}-{number}", "stretcher", course + 2, span, height)
    (folder / "block.moma").write_text("\n".join(lines) + "\n", encoding="utf-8")
    scene = SCENE.replace('kind = "ashlar"', 'kind = "entity"').replace("friction = 0.35", "friction = 0.7")
    (folder / "block.toml").write_text(scene, encoding="utf-8")
    url = f"sqlite:///{folder / 'block.db'}"
    moma.ingest([str(folder / "block.moma")], url)
    return url


def _stone(
    code: str, kind: str, course: int, along: tuple[float, float], up: tuple[float, float]
) -> list[str]:
    corners = [(along[0], up[0]), (along[1], up[0]), (along[1], up[1]), (along[0], up[1])]
    return [
        f"stone {code} {kind} course {course}",
        *(f"  vertex {x:.3f} 0 {z:.3f}" for x, z in corners),
        "end",
    ]
