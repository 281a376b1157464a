"""Make the survey of a wall that does not exist, as a total station and a camera would have delivered it.

    python docs/howto/survey/wall.py FOLDER

writes points.txt, a PNEZD list; head.moma, what the list cannot say; and gable.moma, stones that were measured on
a photograph. What is wrong with the wall and with its measurement is listed in FAULTS.
"""

import sys
from math import cos, radians, sin
from pathlib import Path
from random import Random

SIGMA = 0.002  # of a coordinate [m]
LENGTH, COURSES, SETTLED, SAG = 5.4, 8, 4, 0.014  # the lower four courses sag by 14 mm, the upper four do not
STATION = (100.0, 100.0, 10.0)  # of the instrument, in its own frame [m]
FAULTS = {
    "G02-04": "a stone of 0.74 m that is called a header",
    "G03-02": "a point measured on a branch, 15 cm in front",
    "G05-03": "a coordinate with the letter O for a nought",
    "G06-05": "three corners and nothing else",
    "C4": "a control point whose target was moved by 4 cm",
}

Place = tuple[float, float, float]


def on_wall(s: float, t: float, out: float = 0.0) -> Place:
    """A place of the wall in the frame of the instrument: s to the right, t up, out towards the viewer [m]."""
    turn = radians(18.0)
    along, outward = (cos(turn), sin(turn)), (sin(turn), -cos(turn))
    return (97.0 + s * along[0] + out * outward[0], 112.0 + s * along[1] + out * outward[1], 9.2 + t)


def on_site(place: Place) -> Place:
    """The same place in the frame of the site: east, north, height [m]."""
    turn = radians(-31.0)
    x, y, z = (a - b for a, b in zip(place, STATION, strict=True))
    return (361204.52 + cos(turn) * x - sin(turn) * y, 5402118.37 + sin(turn) * x + cos(turn) * y, 287.14 + z)


def bed(course: int, s: float) -> float:
    """Height of a bed: what was built before the wall settled has sagged."""
    sagged = SAG * (1.0 - (2.0 * s / LENGTH - 1.0) ** 2) if course <= SETTLED else 0.0
    return 0.31 * (course - 1) - sagged


def stones(random: Random) -> list[tuple[str, str, int, float, float]]:
    """Code, kind, course, start and stop along the wall of every stone."""
    found = []
    for course in range(1, COURSES + 1):
        start, number = 0.0, 0
        kinds = ["stretcher", "header"] if course % 2 else ["header", "stretcher"]
        while start < LENGTH - 0.2:
            number += 1
            code, kind = f"G{course:02d}-{number:02d}", kinds[number % 2]
            size = random.uniform(0.56, 0.66) if kind == "stretcher" else random.uniform(0.32, 0.37)
            if code == "G02-04":
                kind, size = "header", 0.74
            stop = LENGTH if LENGTH - start - size < 0.2 else start + size
            if code != "G02-04":
                kind = "header" if stop - start < 0.45 else "stretcher"  # what closes a course as it fits
            found.append((code, kind, course, start, stop))
            start = stop + 0.01
    return found


def face(code: str, course: int, start: float, stop: float, random: Random) -> list[tuple[str, Place]]:
    """Role and place of every point measured on one face."""
    out, rise = random.gauss(0.0, 0.002), random.gauss(0.0, 0.0015)
    low = [bed(course, s) + rise for s in (start, stop)]
    high = [bed(course, s) + 0.30 + rise for s in (start, stop)]
    corners = [(start, low[0]), (stop, low[1]), (stop, high[1]), (start, high[0])]
    inside = [(start + (stop - start) * u, low[0] + 0.30 * v) for u, v in
              ((0.1, 0.12), (0.5, 0.08), (0.9, 0.15), (0.88, 0.85), (0.45, 0.9), (0.12, 0.86))]  # fmt: skip
    if code == "G06-05":
        corners, inside = corners[:3], []
    points = [("v", place) for place in corners] + [("p", place) for place in inside]
    measured = []
    for k, (role, (s, t)) in enumerate(points):
        x, y, z = on_wall(s, t, out + (0.15 if (code, k) == ("G03-02", 7) else 0.0))
        measured.append((role, (random.gauss(x, SIGMA), random.gauss(y, SIGMA), random.gauss(z, SIGMA))))
    return measured


def point_list(random: Random) -> str:
    """The PNEZD list of the instrument."""
    lines, number = ["point,northing,easting,elevation,description"], 100
    for code, kind, course, start, stop in stones(random):
        for k, (role, (x, y, z)) in enumerate(face(code, course, start, stop, random)):
            number += 1
            northing = f"{y:.3f}O" if (code, k) == ("G05-03", 2) else f"{y:.4f}"
            lines.append(f"{number},{northing},{x:.4f},{z:.4f},{code} {kind} {course} {role}")
    return "\n".join(lines) + "\n"


def control(random: Random) -> list[str]:
    """Six targets, known to the instrument and on the site."""
    targets = {"C1": (-1.0, 0.2), "C2": (6.5, 0.4), "C3": (6.3, 3.4), "C4": (2.6, 3.9), "C5": (-0.8, 3.1)}
    lines = []
    for name, (s, t) in {**targets, "C6": (2.8, -0.3)}.items():
        place = on_wall(s, t, 0.8 if name == "C6" else 0.0)
        x, y, z = (random.gauss(one, SIGMA) for one in place)
        east, north, up = (random.gauss(one, 0.003) for one in on_site(place))
        east += 0.04 if name == "C4" else 0.0
        lines.append(
            f"control {name} {x:.4f} {y:.4f} {z:.4f} site {east:.3f} {north:.3f} {up:.3f} sigma 0.003"
        )
    return lines


def head(targets: list[str]) -> str:
    """What the list does not say, in the native format."""
    lines = [
        "moma-survey 1",
        "# synthetic: no such wall exists; made by wall.py",
        "name garden wall (synthetic)",
        "observer " + " ".join(f"{one:.3f}" for one in STATION),
        f"sigma {SIGMA:g}",
        *targets,
        "depth header 0.55 sigma 0.03 source broken end of G02-01, measured",
        "depth stretcher 0.30 sigma 0.04 source two stretchers beside a breach",
        "depth stretcher course 1-2 0.42 sigma 0.03 source trench of the excavation, plinth of two courses",
        "canon stretcher 0.61 0.30 sigma 0.03 source two feet by one, as in the north range",
    ]
    return "\n".join(lines) + "\n"


def photographed(s: float, t: float) -> tuple[float, float]:
    """Where a place of the wall is on the photograph, which was taken from the left and from below [px]."""
    depth = 9.0 + 0.25 * s + 0.12 * t
    return (2000.0 + 3600.0 * (s - 2.0) / depth, 1500.0 - 3600.0 * (t - 2.5 + 0.05 * s) / depth)


def gable(random: Random, targets: list[str]) -> str:
    """Two courses in the native format: every second stone was out of reach, and measured on a photograph."""
    lines = [
        "moma-survey 1",
        "# synthetic: no such wall exists; made by wall.py",
        "name gable (synthetic)",
        "observer " + " ".join(f"{one:.3f}" for one in STATION),
        f"sigma {SIGMA:g}",
        *targets,
        "depth * 0.30 sigma 0.05 source taken as below",
        "photo P1 sigma 1.5",
    ]
    for s, t in ((-0.1, 2.4), (4.6, 2.4), (4.6, 3.3), (-0.1, 3.3), (1.5, 2.42), (3.1, 3.28)):
        u, v = (random.gauss(one, 1.5) for one in photographed(s, t))
        place = " ".join(f"{random.gauss(one, SIGMA):.4f}" for one in on_wall(s, t))
        lines.append(f"mark P1 {u:.1f} {v:.1f} at {place}")
    for course in (9, 10):
        for number in range(7):
            start, low = 0.65 * number, 0.31 * (course - 1)
            corners = [(start, low), (start + 0.63, low), (start + 0.63, low + 0.3), (start, low + 0.3)]
            lines += ["", f"stone G{course:02d}-{number + 1:02d} stretcher course {course}"]
            if (number + course) % 2:
                lines.append("  photo P1")
                for s, t in corners:
                    u, v = (random.gauss(one, 1.5) for one in photographed(s, t))
                    lines.append(f"  pixel {u:.1f} {v:.1f}")
            else:
                inside = [
                    (start + u, low + v) for u, v in ((0.08, 0.05), (0.55, 0.06), (0.56, 0.25), (0.07, 0.24))
                ]
                for word, place in [("vertex", one) for one in corners] + [("point", one) for one in inside]:
                    xyz = (f"{random.gauss(one, SIGMA):.4f}" for one in on_wall(*place))
                    lines.append(f"  {word} {' '.join(xyz)}")
            lines.append("end")
    return "\n".join(lines) + "\n"


def main(folder: Path) -> None:
    """Write the three files."""
    random = Random(1912)
    targets = control(random)
    texts = {
        "points.txt": point_list(random),
        "head.moma": head(targets),
        "gable.moma": gable(random, targets),
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
