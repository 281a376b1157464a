"""A synthetic survey with a scene that runs, written into a folder for people to start from."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from ground.errors import UsageError, storing
from mechanics.dynamics.progress import Listener, silent
from pipelines.samples.copy import WrittenSample, write_new
from survey.arrays import Array
from survey.clouds.wall import Wall, wall_lines
from synthetic.buildings.study_files import STUDIES, study_text
from synthetic.causes import PULSE, Cause
from synthetic.formats import write_head, write_moma, write_obj
from synthetic.granite_wall import GRANITE_SCENE, GRANITE_WALL, MEASURED, units, units_text
from synthetic.photographs import PHOTOGRAPHED, PICTURES, render_photographs, write_photographs
from synthetic.rubble_wall import (
    DEPTH,
    RUBBLE_SCENE,
    RUBBLE_WALL,
    SIZE,
    make_rubble_wall,
    mask_png,
    rubble_truth,
)
from synthetic.samples import Recipe, recipe_of
from synthetic.scan import Scan, outlines_text, write_masks, write_scan

_SCENE = """\
# {title}: synthetic, no such building exists. Every key is explained in docs/scene.md.
{commands}
[scene]
name = "{title} (synthetic)"

# A sound limestone; synthetic values, like the survey.
[materials.limestone]
density = 2350.0   # kg/m³
young = 12e9       # Pa
poisson = 0.2
{core}
[bodies]
default = "rigid"
fixed = ["{fixed}"]

[joints]
max_width = 0.04   # m

[contact]
friction = {friction}
{joints}
[time]
start = "equilibrium"  # found at once; the steps then show that it lasts
step = {step}{pad}# s
theta = 1.0
duration = {duration}     # s
{relaxation}
{loads}
[output]
pictures = ["displacement", "pressure"]
"""

_PUSHED = (RUBBLE_WALL, GRANITE_WALL)
"""Walls for a test rig, known by outlines."""

_SETTLEMENT = """
[[loads]]
type = "settlement"
stones = ["{code}"]
displacement = [0.0, 0.0, {height}]
duration = {duration}
"""
_FORCE = """
[[loads]]
type = "force"
stones = ["{code}"]
force = {force}
"""

_JERK = """
[[loads]]
type = "motion"
stones = ["{fixed}"]
velocity = {{ time = [0.0, {peak}, {end}], value = [[0.0, 0.0, 0.0], {velocity}, [0.0, 0.0, 0.0]] }}
"""
_RELAXED = "relaxation = true  # only where it comes to rest is asked for"
_FOLLOWED = "relaxation = false # the motion itself is followed"

_SPRINGS = """\
placement = "centroid"  # joints bend on their springs like the whole bed

# Soft lime mortar, which has crept; synthetic values. The amount of a thrust is known no better than they are.
[[laws]]
type = "elastic_joint"
friction = 0.6
normal_stiffness = {across:g}  # Pa/m
shear_stiffness = {along:g}
"""
_SCANNED = ("scan.laz", "stones.geojson", "wall.toml", "head.moma", "masks.png")  # files of a scan
_HEAD = "head.moma"  # header file of closed solids
_LONGEST = 3.0  # duration of the scene of a building that has moved [s]

_DIAGNOSIS = """\
# What has moved it? {count} answers, each of unknown amount. Explained in docs/howto/diagnose.md.
{commands}
[diagnosis]
scene = "{kind}.toml"
without = ["loads"]  # the scene knows the cause; a diagnosis is to find it
{built}{hypotheses}"""

_BATTERED = "battered = true\n"

_HYPOTHESIS = """
[[hypotheses]]
name = "{name}"

[[hypotheses.unknowns]]
name = "{unknown}"
unit = "{unit}"
start = {start}
low = {low}
high = {high}
{scan}{loads}"""

_TILT = """
[[loads]]
type = "motion"
stones = ["{fixed}"]
spin = {{ time = [0.0, {duration}, {after}], value = ["= tilt / {duration}", "= tilt / {duration}", 0.0] }}
axis = [{axis[0]:.6f}, {axis[1]:.6f}, 0.0]
pivot = [{pivot[0]:.3f}, {pivot[1]:.3f}, {pivot[2]:.3f}]
"""
_INSTANT = 1e-6  # in which the tilt of the base ends [s]
_SCAN = "scan = 5  # stones slide from a threshold on\n"

_CORE = """
# Mortar and small stones between the facings.
[materials.core]
stones = ["kind = infill"]
density = 1900.0
young = 1e9
poisson = 0.2
"""


def write_sample(
    kind: str,
    folder: Path,
    progress: Listener = silent,
    *,
    moved: str | None = None,
    small: bool = False,
    phases: bool = False,
    scan: bool = False,
    courses: int | None = None,
    photographs: bool = False,
    pictures: bool = False,
) -> WrittenSample:
    """Write KIND.moma, truth.json and KIND.toml into a folder, created if necessary; of walls for a rig, outlines.

    Some come with knowledge.toml, with solids.obj and its head.moma, with diagnosis.toml, or with scan.laz, the
    outlines stones.geojson, the frame wall.toml and head.moma.

    Parameters
    ----------
    kind, moved, small, phases, scan, courses : as of `recipe_of`
    folder : in which none of these files exists; created if necessary
    progress : called at every step of the simulation that moves the stones of some
    photographs : photographs.toml, marks.txt, control.txt and marked.moma too: of the window
    pictures : the photographs themselves too, rendered into the folder `pictures`

    Raises
    ------
    UsageError
        if there is no such sample, or a file would be overwritten
    MissingLibraryError
        if no picture can be rendered on this machine
    StorageError
        if the disk is full, for example; none of the files is left then
    """
    if kind in _PUSHED:
        if moved or small or phases or scan or courses is not None or photographs or pictures:
            raise UsageError(f"an option with the sample {kind!r}", remedy="it has none")
        return _write_rubble_wall(folder) if kind == RUBBLE_WALL else _write_granite_wall(folder)
    if photographs and kind != "window":
        raise UsageError(f"--photographs with the sample {kind!r}", remedy="it is for the window")
    if pictures and not photographs:
        raise UsageError("--pictures without --photographs", remedy="give --photographs too")
    recipe = recipe_of(kind, moved=moved, small=small, phases=phases, scan=scan, courses=courses)
    cause = recipe.cause
    survey, scene, truth = folder / f"{kind}.moma", folder / f"{kind}.toml", folder / "truth.json"
    diagnosis = None if cause is None else folder / "diagnosis.toml"
    # before a simulation that takes minutes
    studied = [folder / "study.toml"] if kind in STUDIES and not scan else []
    _must_be_new(survey, truth, scene, *studied, *([] if diagnosis is None else [diagnosis]))
    sample = recipe.make(progress)
    knowledge = folder / "knowledge.toml" if sample.knowledge else None
    solids = folder / "solids.obj" if sample.modelled else None
    commands = tuple(_commands(recipe, survey, solids, knowledge, scene, diagnosis))
    texts = {truth: sample.truth, scene: _scene(recipe, commands)}
    if kind in STUDIES and not scan:
        texts[folder / "study.toml"] = study_text(kind, str(folder))
    if diagnosis is not None and cause is not None:
        texts[diagnosis] = _diagnosis(kind, recipe.fixed, cause, commands)
    if knowledge is not None:
        texts[knowledge] = sample.knowledge
    extra: tuple[Path, ...] = () if solids is None else (solids, solids.with_name(_HEAD))
    if sample.scan is not None:
        extra = tuple(folder / name for name in _SCANNED)
    if photographs:
        extra += tuple(folder / name for name in PHOTOGRAPHED)
        extra += tuple(folder / "pictures" / name for name in PICTURES) if pictures else ()
        project, result = folder / "photographs.toml", folder / "photographs"
        commands = (f"moma orient {project} --out {result}", *commands)
    _must_be_new(*texts, *extra)
    paths = (survey, *texts, *extra)
    with storing(str(folder)):
        folder.mkdir(parents=True, exist_ok=True)
        with _all_or_none(paths):
            write_moma(sample.survey, survey)
            for path, text in texts.items():
                path.write_text(text, encoding="utf-8", newline="\n")
            if solids is not None:
                write_obj(sample.modelled, solids)
                head = sample.survey.head
                write_head(replace(head, name=f"{head.name}, closed solids"), solids.with_name(_HEAD))
            if sample.scan is not None:
                _write_scan(sample.scan, folder)
            if photographs:
                write_photographs(folder, pictures)
            if pictures:
                (folder / "pictures").mkdir(exist_ok=True)
                render_photographs(folder / "pictures")
    files = tuple(map(str, paths))
    stones = len(sample.survey.blocks) + len(sample.modelled)
    return WrittenSample(kind, recipe.title, stones, files, commands)


def _write_rubble_wall(folder: Path) -> WrittenSample:
    """Write the mask of a wall of rubble, its truth and its scene."""
    wall, mask, scene = make_rubble_wall(), folder / "wall.png", folder / f"{RUBBLE_WALL}.toml"
    width, height = SIZE
    taken = f"--masks {mask} --size {width:g}x{height:g} --depth {DEPTH:g} --kind rubble"
    commands = _pushed(taken, scene)
    files: dict[Path, str | bytes] = {
        mask: mask_png(wall),
        folder / "truth.json": rubble_truth(wall),
        scene: RUBBLE_SCENE.format(commands=_listed(commands)),
    }
    write_new(
        folder,
        {
            path: content if isinstance(content, bytes) else content.encode()
            for path, content in files.items()
        },
    )
    return WrittenSample(RUBBLE_WALL, "Rubble wall", len(wall.stones), tuple(map(str, files)), commands)


def _write_granite_wall(folder: Path) -> WrittenSample:
    """Write the units of a wall that a laboratory broke, points of its measured curve and its scene."""
    outlines, scene = folder / "units.csv", folder / f"{GRANITE_WALL}.toml"
    commands = _pushed(f"--outlines {outlines} --size 1x1.2 --depth 0.2 --kind ashlar", scene)
    points = "".join(f"{place:g},{force:g}\n" for place, force in MEASURED)
    files = {
        outlines: units_text(),
        folder / "measured.csv": f"displacement [mm],force [kN]\n{points}",
        scene: GRANITE_SCENE.format(commands=_listed(commands)),
    }
    write_new(
        folder,
        {
            path: content if isinstance(content, bytes) else content.encode()
            for path, content in files.items()
        },
    )
    return WrittenSample(
        GRANITE_WALL, "Granite wall WS.100", len(units()), tuple(map(str, files)), commands, synthetic=False
    )


def _pushed(taken: str, scene: Path) -> tuple[str, ...]:
    """Return the commands from stones that are taken in to a loading test."""
    database = f"--db sqlite:///{scene.with_suffix('.db')}"
    return (
        f"moma ingest {taken} {database}",
        f"moma check {scene} {database}",
        f"moma pushover {scene} {database} --out {scene.parent / 'results'}",
    )


@contextmanager
def _all_or_none(paths: Sequence[Path]) -> Iterator[None]:
    """Remove new files where a with-block that writes them fails."""
    try:
        yield
    except BaseException:
        for path in paths:
            path.unlink(missing_ok=True)
        raise


def _write_scan(scan: Scan, folder: Path) -> None:
    cloud, outlines, frame, head, masks = (folder / name for name in _SCANNED)
    write_scan(scan, cloud)
    write_masks(scan, masks)
    outlines.write_text(outlines_text(scan), encoding="utf-8", newline="\n")
    wall = Wall(scan.bay.frame.origin, scan.bay.frame.axes)
    frame.write_text(wall_lines(wall), encoding="utf-8", newline="\n")
    write_head(replace(scan.bay.survey.head, name=f"{scan.bay.survey.head.name}, scanned"), head)


def _must_be_new(*paths: Path) -> None:
    for path in paths:
        if path.exists():
            raise UsageError(f"{path} exists", remedy="name another folder: --out DIR")


def _scene(recipe: Recipe, commands: Sequence[str]) -> str:
    cause = recipe.cause
    step = 0.005 if cause is None else cause.step
    stiffness = None if cause is None else cause.stiffness
    return _SCENE.format(
        title=recipe.title,
        friction=0.6 if cause is None else cause.friction,
        relaxation=_FOLLOWED if cause is not None and cause.pulse else _RELAXED,
        joints="" if stiffness is None else _SPRINGS.format(across=stiffness[0], along=stiffness[1]),
        commands=_listed(commands),
        core=_CORE if recipe.core else "",
        fixed=recipe.fixed,
        step=step,
        pad=" " * (12 - len(str(step))),
        duration=1.0 if cause is None else _LONGEST,
        loads="" if cause is None else "".join(_loads(cause, recipe.fixed)),
    )


def _listed(commands: Sequence[str]) -> str:
    return "".join(f"#   {command}\n" for command in commands)


def _diagnosis(kind: str, fixed: str, cause: Cause, commands: Sequence[str]) -> str:
    """Return hypotheses on the movement of a building, the true one first."""
    site = cause.build({}, None)
    first, second = ("core decayed and sank", "left corner settled") if site.core else _CORNERS
    hypotheses = [_settled(first, cause, site.settled)]
    if site.rival:
        hypotheses.append(_settled(second, cause, site.rival))
    tilt = _TILT.format(
        fixed=fixed,
        duration=cause.duration,
        after=cause.duration + _INSTANT,
        axis=site.axis,
        pivot=site.building.solids[0].vertices[0],
    )
    hypotheses.append(_hypothesis("the base tilted", "tilt", "degrees", (0.1, -1.0, 1.0), tilt))
    if site.pushed:
        thrusts = [
            _FORCE.format(code=stones, force=_formulas("thrust", out)) for stones, out in site.pushed.items()
        ]
        name, values = "the thrust of a vault pushed the walls out", (0.25 * cause.most, 0.0, cause.most)
        hypotheses.append(_hypothesis(name, "thrust", "N", values, "".join(thrusts)))
    else:
        top = max(
            site.building.survey.blocks, key=lambda block: block.course or 0
        ).code  # the first of its course
        load = _FORCE.format(code=top, force='[0.0, 0.0, "= -load"]')
        name = "a load stood on the upper left corner"
        hypotheses.append(_hypothesis(name, "load", "N", (5000.0, 0.0, 50000.0), load))
    if site.jerked is not None:
        jerks = [
            _hypothesis(
                f"an earthquake pulse jerked the ground {way}",
                "peak",
                "m/s",
                (0.1, 0.0, 1.0),
                _jerk(fixed, _formulas("peak", sign * site.jerked)),
                _SCAN,
            )
            for way, sign in (("inwards", 1.0), ("outwards", -1.0))
        ]
        hypotheses = [jerks[0], *hypotheses, jerks[1]]
    dated = cause.stood is not None
    return _DIAGNOSIS.format(
        count=_COUNTS[len(hypotheses)],
        commands=_listed(commands),
        kind=kind,
        built=(_BATTERED if cause.battered else "")
        + ('phases = ["1", "2"]  # the oldest first\n' if dated else ""),
        hypotheses="".join(hypotheses),
    )


_CORNERS = ("left corner settled", "right corner settled")
_COUNTS = {3: "Three", 4: "Four", 5: "Five"}


def _hypothesis(
    name: str, unknown: str, unit: str, values: tuple[float, float, float], loads: str, scan: str = ""
) -> str:
    """Return a hypothesis with an unknown, of which start, least and largest value are given."""
    start, low, high = values
    loads = loads.replace("[[loads]]", "[[hypotheses.scene.loads]]")
    return _HYPOTHESIS.format(
        name=name, unknown=unknown, unit=unit, start=start, low=low, high=high, scan=scan, loads=loads
    )


def _settled(what: str, cause: Cause, shares: Mapping[str, float]) -> str:
    loads = [
        _SETTLEMENT.format(code=code, height=f'"= -settlement * {share:.4g}"', duration=cause.duration)
        for code, share in shares.items()
    ]
    return _hypothesis(f"the {what}", "settlement", "m", (0.010, 0.0, 0.060), "".join(loads))


def _formulas(unknown: str, direction: Array) -> str:
    """Return the horizontal components of a vector of unknown length."""
    x, y = (f"= {unknown} * {part:.6f}" for part in direction[:2])
    return f'["{x}", "{y}", 0.0]'


def _jerk(fixed: str, velocity: str) -> str:
    peak, end = PULSE
    return _JERK.format(fixed=fixed, peak=peak, end=end, velocity=velocity)


def _loads(cause: Cause, fixed: str) -> Iterator[str]:
    yield "\n# What moved it: the same as in the truth.\n"
    site = cause.build({}, None)
    for code, height in cause.heights(site).items():
        yield _SETTLEMENT.format(code=code, height=height, duration=cause.duration)
    for code, force in cause.forces(site).items():
        yield _FORCE.format(code=code, force=list(force))
    jerk = cause.jerk(site)
    if jerk is not None:
        yield _jerk(fixed, str(list(jerk)))


def _commands(
    recipe: Recipe,
    survey: Path,
    solids: Path | None,
    knowledge: Path | None,
    scene: Path,
    diagnosis: Path | None,
) -> Iterator[str]:
    database = f"--db sqlite:///{survey.with_suffix('.db')}"
    if recipe.scan:
        cloud, outlines, frame, head, _ = (survey.with_name(name) for name in _SCANNED)
        drawn = f"--outlines {outlines} --wall {frame} --header {head}"
        yield f"moma ingest --cloud {cloud} {drawn} --sigma 0.0015 {database}"
    else:
        yield f"moma ingest {survey} {database}"
    if solids is not None:
        yield f"moma ingest {solids} --format solids --header {solids.with_name(_HEAD)} {database}"
    if knowledge is not None:
        yield f"moma record {knowledge} {database}"
    if recipe.core:
        yield f"moma propose infill --record {database}"
    yield f"moma run {scene} {database} --out {scene.parent / 'results'}"
    if recipe.cause is not None and recipe.cause.stood is None:
        battered = "--battered " if recipe.cause.battered else ""
        yield f"moma compare {scene} {battered}{database} --out {scene.parent / 'comparison'}"
    if diagnosis is not None:
        yield f"moma diagnose {diagnosis} {database} --out {scene.parent / 'diagnosis'}"
