"""Commands that read survey files, or write one to start from."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from ground.errors import UsageError
from moma.cli.console import reporting, say
from moma.cli.options import (
    CloudChoices,
    Common,
    DrawnChoices,
    Json,
    Overwrite,
    SolidChoices,
    SurveyChoices,
    Verbose,
    check_ending,
)
from moma.cli.progress import progress_bars

if TYPE_CHECKING:
    from survey.formats.options import ReadingOptions


Level = Literal["good", "medium", "poor"]
"""Grades of what a survey does not tell about masonry."""


Moved = Literal["settlement", "thrust", "earthquake"]
"""Causes of movement of samples."""


Blunders = Literal["report", "remove"]
"""Treatment of marks that the test finds wrong."""


@dataclass(frozen=True)
class _SampleChoices:
    """Variant of a sample."""

    moved: Annotated[
        Moved | None,
        typer.Option(
            help="Move its stones by a simulation: the wall by any cause, facings and tower by settlement."
        ),
    ] = None
    small: Annotated[
        bool, typer.Option("--small", help="Smaller: the tower, and the wall with --moved settlement.")
    ] = False
    phases: Annotated[
        bool,
        typer.Option("--phases", help="Upper courses were laid later: the wall with --moved settlement."),
    ] = False
    scan: Annotated[
        bool, typer.Option("--scan", help="With a scan and outlines of the stones: the window.")
    ] = False
    photographs: Annotated[
        bool, typer.Option("--photographs", help="Marks on twelve photographs of the window too, to orient.")
    ] = False


@reporting
def sample(
    *,
    kind: Annotated[
        str,
        typer.Argument(
            help="arch, block, corner, facings, ribvault, tower, vault, wall, window, rubble-wall or granite-wall."
        ),
    ],
    variant: _SampleChoices,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder for the files; default: KIND.")
    ] = None,
    json: Json = False,
) -> None:
    """Write a survey with its truth and a scene that runs, to start from: synthetic, but of granite-wall."""
    from moma.cli.text.formats import as_json
    from pipelines.samples.copy import copy_sample

    written = copy_sample(kind, out or Path(kind), **vars(variant))
    lines = [
        f"{written.title}: {'a synthetic survey of ' if written.synthetic else ''}{written.stones} stones",
        *(f"  {path}" for path in written.files),
        "run it with",
        *(f"  {command}" for command in written.commands),
    ]
    print(as_json(asdict(written)) if json else "\n".join(lines))


@dataclass(frozen=True)
class _ExportChoices:
    """Statements of a project file, for an export without one."""

    photomodeler: Annotated[
        Path | None,
        typer.Option(
            "--photomodeler", metavar="FILE", help="Text export of PhotoModeler, without a project file."
        ),
    ] = None
    control: Annotated[
        Path | None,
        typer.Option("--control", metavar="FILE", help="Control points: number, name, X, Y, Z, deviations."),
    ] = None
    calibrate: Annotated[
        str | None,
        typer.Option(
            "--calibrate",
            metavar="LIST",
            help="Parameters of the camera that are estimated, e.g. c,xp,yp,K1,K2.",
        ),
    ] = None
    fixed_control: Annotated[
        bool,
        typer.Option("--fixed-control", help="Control points keep their places, whatever their deviations."),
    ] = False
    check: Annotated[
        str | None, typer.Option("--check", metavar="LIST", help="Control points that only check the result.")
    ] = None
    size: Annotated[
        str | None,
        typer.Option(
            "--size",
            metavar="WIDTHxHEIGHT",
            help="Size of the photographs in pixels, where the export does not state it.",
        ),
    ] = None
    blunders: Annotated[
        Blunders | None,
        typer.Option(help="Whether marks that the test finds wrong are left out; default: report."),
    ] = None


@reporting
def orient(
    *,
    project: Annotated[
        Path | None,
        typer.Argument(metavar="PROJECT.toml", help="Project file; see docs/howto/photographs.md."),
    ] = None,
    export: _ExportChoices,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for the results; default: out/PROJECT."),
    ] = None,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Orient photographs: bundle adjustment with calibration, precision of every point, blunders."""
    from ground.kernels.beside import compiling_beside
    from moma.cli.text.formats import as_json
    from moma.cli.text.photographs import orient_lines
    from pipelines.orient.orient import orient_photographs, photomodeler_project
    from pipelines.orient.project import read_project

    if (project is None) == (export.photomodeler is None):
        raise UsageError("neither or both of PROJECT.toml and --photomodeler", remedy="give one of them")
    if project is not None:
        for name, value in vars(export).items():
            if value not in (None, False):
                option = f"--{name.replace('_', '-')}"
                raise UsageError(f"{option} with a project file", remedy="write it into the project file")
        read = read_project(project)
    else:
        assert export.photomodeler is not None
        read = photomodeler_project(
            export.photomodeler,
            export.control,
            _names(export.calibrate),
            export.fixed_control,
            _names(export.check),
            export.blunders or "report",
            None if export.size is None else _pixels(export.size),
        )
    folder = out or Path("out") / (project or export.photomodeler or Path("photographs")).stem
    with compiling_beside("orient"):
        report = orient_photographs(read, folder)
    for remark in report.values["remarks"]:
        say(f"warning: {remark}")
    left = ("covariance", "marks")
    shown = {name: value for name, value in report.values.items() if name not in left}
    print(as_json({**shown, "folder": str(folder)}) if json else "\n".join(orient_lines(report, verbose)))


def _pixels(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    if not (width.strip().isdecimal() and height.strip().isdecimal()):
        raise UsageError(f"--size {text!r}", remedy="write width and height in pixels, e.g. --size 6000x4000")
    return int(width), int(height)


def _names(text: str | None) -> tuple[str, ...]:
    return tuple(one.strip() for one in text.split(",") if one.strip()) if text else ()


@reporting
def ingest(
    *,
    survey: SurveyChoices,
    solids: SolidChoices,
    keep_going: Annotated[
        bool,
        typer.Option(
            "--keep-going", help="Ingest the good stones, and write the others to a file of rejects."
        ),
    ] = False,
    rejects: Annotated[
        Path | None,
        typer.Option(
            "--rejects", metavar="FILE", help="File of rejects; default: NAME.rejects beside the survey file."
        ),
    ] = None,
    again: Annotated[
        bool,
        typer.Option(
            "--again", help="Accept new measurements of stones in the database; earlier ones are kept."
        ),
    ] = False,
    drawn: DrawnChoices,
    review: Annotated[
        Path | None,
        typer.Option("--review", metavar="FILE.csv", help="List of the outlines that should be looked at."),
    ] = None,
    common: Common,
) -> None:
    """Ingest survey files into the database: all of them, or none if anything is wrong."""
    from ground.kernels.beside import compiling_beside
    from moma.cli.text.formats import as_json
    from moma.cli.text.runs_and_surveys import ingest_lines
    from pipelines.ingest.ingest import ingest as ingest_files
    from pipelines.ingest.kind_rules import kind_rules

    check_ending(review, ".csv")
    if rejects is not None and not keep_going:
        raise UsageError("--rejects without --keep-going", remedy="give --keep-going too")
    rules = kind_rules(solids.kind_where or (), solids.support or ())
    name, paths, options = sources(survey, drawn, solids)
    if review is not None and name not in ("cloud", "masks"):
        raise UsageError("--review without --cloud or --masks", remedy="it lists outlines")
    with compiling_beside("ingest"), progress_bars() as listener:
        report = ingest_files(
            paths,
            common.db,
            name,
            listener,
            options=options,
            keep_going=rejects or keep_going,
            again=again,
            rules=rules,
        )
    if review is not None:
        from pipelines.ingest.outlined import write_review

        write_review(review, [outline for file in report.files for outline in file.review])
    print(as_json(asdict(report)) if common.json else "\n".join(ingest_lines(report, common.verbose)))


@dataclass(frozen=True)
class MasonryChoices:
    """Qualities of masonry that no survey tells."""

    mortar: Annotated[
        Level | None, typer.Option(help="Quality of the mortar, for the masonry quality index.")
    ] = None
    state: Annotated[
        Level | None, typer.Option(help="State and strength of the stones, for the masonry quality index.")
    ] = None


@reporting
def survey_report(
    *,
    survey: SurveyChoices,
    drawn: CloudChoices,
    orthophoto: Annotated[
        Path | None,
        typer.Option(
            "--orthophoto",
            metavar="FILE.png",
            help="Draw elevations on it: with a world file, and FILE.toml, the frame of its wall.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for the report; default: out/survey-FILE."),
    ] = None,
    since: Annotated[
        list[Path] | None,
        typer.Option(
            "--since",
            metavar="FILE",
            help="Survey of an earlier campaign: compare stone by stone; repeatable.",
        ),
    ] = None,
    masonry: MasonryChoices,
    overwrite: Overwrite = False,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Judge survey files without a database: precision, what has moved, masonry, kinds, stones to measure again."""
    from moma.cli.text.runs_and_surveys import survey_report_lines
    from pipelines.reports.survey.report import INDEX, report_surveys
    from survey.quality.masonry.index import given_grade

    name, paths, options = sources(survey, drawn)
    folder = out or Path("out") / f"survey-{(drawn.outlines or paths[0]).resolve().stem}"
    levels = {"MM": masonry.mortar, "SM": masonry.state}
    given = {name: given_grade(level) for name, level in levels.items() if level is not None}
    with progress_bars() as listener:
        report = report_surveys(
            paths, folder, name, options, listener, given, overwrite, orthophoto, since or ()
        )
    for warning in report.study.warnings:
        say(f"warning: {warning}")
    lines = survey_report_lines(report, verbose)
    print((folder / INDEX).read_text(encoding="utf-8").rstrip() if json else "\n".join(lines))


@reporting
def cloud(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILE…", help="Point clouds: LAS, LAZ, E57, PTX, PLY, PCD, XYZ or PTS."),
    ],
    wall: Annotated[
        str | None,
        typer.Option(
            "--wall",
            metavar="FRAME",
            help='FILE.toml, or two points on the wall\'s foot, "X,Y X,Y"; default: the largest upright plane.',
        ),
    ] = None,
    pixel: Annotated[float, typer.Option(metavar="T", help="Side of a pixel in metres.")] = 0.005,
    slab: Annotated[
        float, typer.Option(metavar="T", help="Largest distance of a drawn point from the plane of the wall.")
    ] = 0.5,
    section: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PLANE",
            help="Section, e.g. z=1.5 level, s=2.0 upright across the wall, or d=-0.01 along it; may be repeated.",
        ),
    ] = None,
    thickness: Annotated[float, typer.Option(metavar="T", help="Thickness of a section in metres.")] = 0.02,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for the files; default: out/cloud-FILE."),
    ] = None,
    json: Json = False,
) -> None:
    """Draw a point cloud: orthophoto and depth map of a wall, sections as polylines."""
    from dataclasses import asdict

    from moma.cli.text.formats import as_json
    from pipelines.draw.cloud_views import draw_views

    folder = out or Path("out") / f"cloud-{files[0].stem}"
    with progress_bars() as listener:
        drawn = draw_views(
            files,
            folder,
            wall,
            pixel=pixel,
            slab=slab,
            sections=section or (),
            thickness=thickness,
            progress=listener,
        )
    for warning in drawn.warnings:
        say(f"warning: {warning}")
    lines = [
        f"{drawn.points} points, {drawn.shown} of them on the wall, {drawn.width:.2f} × {drawn.height:.2f} m",
        *(f"  section {one.name}: {one.lines} polylines, {one.length:.2f} m" for one in drawn.sections),
        *(f"  {path}" for path in drawn.files),
    ]
    print(as_json(asdict(drawn)) if json else "\n".join(lines))


def sources(
    survey: SurveyChoices, drawn: CloudChoices, solids: SolidChoices | None = None
) -> "tuple[str, list[Path], ReadingOptions]":
    """Return the format of survey files, the files, and the options with which they are read.

    Raises
    ------
    UsageError
        if options contradict each other, or are of another format
    """
    from pipelines.ingest.reading_options import format_of_all, reading_options, solid_options

    choices = {name: value for name, value in vars(survey).items() if name not in ("files", "format")}
    options = reading_options(**choices)
    if solids is not None:
        up = solids.up
        options = solid_options(options, up, solids.repair, solids.snap, solids.planes)
        choices |= {"up": up, "repair": solids.repair, "snap": solids.snap, "planes": solids.planes}
    if (outlines := _outlined(options, survey, drawn)) is not None:
        _check_fitting(outlines[0], choices)
        return outlines
    if not survey.files:
        raise UsageError("no survey file", remedy="name at least one")
    name = survey.format or format_of_all(survey.files)
    _check_fitting(name, choices)
    return name, survey.files, options


def _outlined(
    base: "ReadingOptions", survey: SurveyChoices, drawn: CloudChoices
) -> "tuple[str, list[Path], ReadingOptions] | None":
    """Return format, files and options of a cloud with outlines, or of masks or outlines alone; None without any.

    Outlines without a cloud are known by the size or depth that goes with them.
    """
    given = dict(vars(drawn))
    clouds, masks = given.pop("cloud"), given.pop("masks", None)
    named = {
        f"--{'fields' if name == 'chosen' else name.replace('_', '-')}": name
        for name in given
        if given[name] is not None
    }
    alone = (
        given["outlines"]
        if clouds is None and masks is None and {"--depth", "--size"} & named.keys()
        else masks
    )
    if clouds is None and alone is None:
        for option in named:
            sizes = option in ("--size", "--depth")
            lacking = (
                "--masks"
                if sizes
                else "--cloud or --masks"
                if option in ("--wall", "--fields")
                else "--cloud"
            )
            files = "--masks or --outlines too" if sizes else "--cloud FILE and --outlines FILE"
            alternative = "; or --depth, for outlines alone" if option == "--outlines" else ""
            raise UsageError(f"{option} without {lacking}", remedy=f"give {files}{alternative}")
        return None
    main = "--cloud" if clouds else "--masks" if masks else "--outlines"
    if survey.files or (clouds and masks):
        other = "--masks" if clouds and masks else "survey files"
        raise UsageError(f"{other} beside {main}", remedy="ingest one after the other")
    if survey.format is not None:
        raise UsageError(f"--format beside {main}", remedy="leave it out")
    from pipelines.ingest.outlined import cloud_options, mask_options

    fitting = _OF_CLOUDS if clouds else _OF_MASKS if masks else _OF_OUTLINES
    for option, name in named.items():
        if name not in fitting and option != main:
            raise UsageError(f"{option} with {main}", remedy="leave it out")
    choices = {name: given[name] for name in fitting}
    if alone is not None:
        return "masks", [alone], mask_options(base, **choices)
    if given["outlines"] is None:
        raise UsageError(
            "--cloud without --outlines", remedy="name the outlines of its stones: --outlines FILE"
        )
    return "cloud", list(clouds or ()), cloud_options(base, **choices)


def _check_fitting(name: str, choices: Mapping[str, object]) -> None:
    """Refuse options of tables and of solids with other formats, and a unit with files that are in metres."""
    for option in ("snap", "planes", "up", "repair"):
        if choices.get(option) is not None and name != "solids":
            raise UsageError(f"--{option} with format {name}", remedy="it is for --format solids")
    for option in ("columns", "sheet", "kinds", "roles"):
        unfit = ("moma", "solids") if option == "kinds" else ("moma", "solids", "cloud", "masks")
        if choices[option] is not None and name in unfit:
            raise UsageError(f"--{option} with format {name}", remedy="it is for tables and lists of points")
    if choices["unit"] is not None and name == "moma":
        raise UsageError(f"--unit with format {name}", remedy="its lengths are metres")


_OF_MASKS = ("size", "depth", "wall", "chosen", "layer")
_OF_OUTLINES = (*_OF_MASKS, "outline_sigma")
_OF_CLOUDS = ("outlines", "wall", "layer", "chosen", "outline_sigma", "margin", "slab")
