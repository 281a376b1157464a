"""Extremes on the command line: what can be computed is, the rest is one line that says why, with its exit code."""

import json

import pytest

from tests.moma.commands import fails, invoke, prints

FACES = ((1, 4, 3, 2), (5, 6, 7, 8), (1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8))
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
SCENE = """
[materials.stone]
density = {density}
young = {young}
poisson = 0.2

[bodies]
default = "{default}"
fixed = {fixed}

[mesh]
size = {size}
element = "hex8"

[joints]
mode = "as-surveyed"

[contact]
friction = {friction}

[time]
step = {step}
duration = {duration}

[solver]
max_iterations = {iterations}

[output]
pictures = []
"""
USUAL = {
    "density": 2400.0, "young": "1e12", "default": "rigid", "fixed": '["base"]', "friction": 0.6, "size": 0.02,
    "step": 1e-5, "duration": 1e-4, "iterations": 2000,
}  # fmt: skip


def boxes(path, **stones):
    """Write an OBJ file of boxes, each from a corner to another [m]."""
    lines = []
    for number, (name, (low, high)) in enumerate(stones.items()):
        lines.append(f"o {name}")
        wide = [b - a for a, b in zip(low, high, strict=True)]
        corners = [[a + u * w for a, u, w in zip(low, unit, wide, strict=True)] for unit in CORNERS]
        lines += ["v " + " ".join(f"{x:.17g}" for x in corner) for corner in corners]
        lines += ["f " + " ".join(str(i + 8 * number) for i in face) for face in FACES]
    path.write_text("\n".join(lines) + "\n")


def stack(path, size):
    """Two stones on a base, `size` wide [m]."""
    s = size
    boxes(
        path,
        base=((-s, -s, -s), (2 * s, 2 * s, 0.0)),
        A=((0, 0, 0), (s, s, s / 2)),
        B=((0.1 * s, 0, s / 2), (1.1 * s, s, s)),
    )


@pytest.fixture
def run(tmp_path):
    """A function that runs a scene on stones of an OBJ file, and what came of it."""

    def running(make, more="", *options, **changes):
        url = f"sqlite:///{tmp_path / 'moma.db'}"
        make(tmp_path / "stones.obj")
        prints("ingest", tmp_path / "stones.obj", "--format", "solids", "--db", url)
        scene = tmp_path / "scene.toml"
        scene.write_text(SCENE.format(**USUAL | changes) + more)
        return invoke("run", scene, "--out", tmp_path / "out", "--db", url, "--json", *options)

    return running


@pytest.mark.parametrize(("size", "default"), [(0.02, "rigid"), (0.02, "deformable"), (1e4, "rigid")])
def test_stones_of_two_centimetres_and_ten_kilometres_stand(run, size, default):
    """E = 1 TPa, h = 10 µs: exit code 0, every step solved, the reaction is the weight ρ g V to 1e-4.

    No stone is that long, so the scene is run as one that is accepted unsound.
    """
    done = run(lambda path: stack(path, size), "", "--accept-unsound", default=default)
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    weight = 2400.0 * 9.81 * 2 * size**3 / 2
    assert told["reaction"]["weight"] == pytest.approx(weight, rel=1e-9)
    assert told["errors"]["unconverged_steps"] == 0
    assert told["displacement"]["max"] < 1e-6 * size
    if default == "rigid":
        assert told["reaction"]["total_vertical"] == pytest.approx(weight, rel=1e-4)


def test_a_stone_squeezed_by_driven_walls_is_told(run):
    """There is no solution: the run says how many steps were not solved, on the screen and in its summary."""
    done = run(
        lambda path: boxes(
            path,
            left=((-0.5, 0, 0), (0, 0.5, 0.5)),
            A=((0, 0, 0), (0.5, 0.5, 0.5)),
            right=((0.5, 0, 0), (1, 0.5, 0.5)),
        ),
        '[[loads]]\ntype = "motion"\nstones = ["left"]\nvelocity = [0.1, 0, 0]\n'
        '[[loads]]\ntype = "motion"\nstones = ["right"]\nvelocity = [-0.1, 0, 0]\n',
        fixed='["left", "right"]',
        step=1e-3,
        duration=5e-3,
        iterations=50,
    )
    assert done.exit_code == 1, done.output
    told = json.loads(done.stdout)
    assert told["outcome"] == "undecided"
    assert told["errors"]["unconverged_steps"] == told["steps"] == 5
    # each wall has come 0.5 mm
    assert told["errors"]["penetration"] > 0.5e-3
    assert "warning: 5 of 5 steps were left above the solver's tolerance" in done.stderr


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("density", "nan"),
        ("density", "0"),
        ("density", "-2400"),
        ("young", "inf"),
        ("young", "-1"),
        ("friction", "nan"),
        ("friction", "1e400"),
        ("step", "0"),
        ("step", "-0.0"),
        ("step", "nan"),
        ("duration", "inf"),
        ("size", "0.0"),
        ("iterations", "0"),
    ],
)
def test_values_that_make_no_sense_are_refused_at_their_line(tmp_path, key, value):
    """Exit code 2, and one line with file, line, value and remedy; nothing is written, no database is needed."""
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.format(**USUAL | {key: value}))
    line = next(n for n, text in enumerate(scene.read_text().splitlines(), 1) if text.endswith(f"= {value}"))
    told = fails(2, "run", scene, "--out", tmp_path / "out", "--db", f"sqlite:///{tmp_path / 'moma.db'}")
    assert f"scene.toml:{line}: " in told
    assert "; give " in told
    assert not (tmp_path / "out").exists()


def test_stones_of_a_millimetre_are_no_stones_of_a_building(tmp_path):
    """Corners nearer than what a survey can tell apart are one: refused with the stone's name, exit code 1."""
    stack(tmp_path / "tiny.obj", 0.001)
    url = f"sqlite:///{tmp_path / 'moma.db'}"
    told = fails(1, "ingest", tmp_path / "tiny.obj", "--format", "solids", "--db", url)
    assert "stone base" in told
    assert "distinct corners" in told


def test_a_survey_with_what_is_no_number_is_refused_at_its_line(tmp_path):
    stack(tmp_path / "stones.obj", 1.0)
    text = (tmp_path / "stones.obj").read_text().replace("v 0 0 0", "v 0 nan 0", 1)
    assert "nan" in text
    (tmp_path / "stones.obj").write_text(text)
    url = f"sqlite:///{tmp_path / 'moma.db'}"
    told = fails(1, "ingest", tmp_path / "stones.obj", "--format", "solids", "--db", url)
    assert "stones.obj" in told
    assert not (tmp_path / "moma.db").exists()
