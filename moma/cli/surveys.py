"""Commands that read survey files, or write one to start from."""

from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from moma.cli.clouds import (
    CloudFiles,
    Depth,
    Fields,
    Layer,
    Margin,
    Masks,
    Outlines,
    OutlineSigma,
    Size,
    Slab,
    Wall,
    outlined,
)
from moma.cli.console import reporting, say
from moma.cli.options import (
    DEFAULT_DB,
    Codes,
    Db,
    Format,
    Header,
    Json,
    Kind,
    KindWhere,
    Planes,
    Sigma,
    Snap,
    Support,
    SurveyFormat,
    SurveyOrCloud,
    Unit,
    Verbose,
)
from moma.cli.progress import progress_bars
from moma.errors import UsageError

__all__ = ["Moved", "ingest", "sample", "survey_report"]


class Moved(StrEnum):
    """Causes of movement of samples."""

    SETTLEMENT = "settlement"
    THRUST = "thrust"
    EARTHQUAKE = "earthquake"


@reporting
def sample(
    kind: Annotated[
        str, typer.Argument(help="arch, corner, facings, ribvault, tower, vault, wall or window.")
    ],
    moved: Annotated[
        Moved | None,
        typer.Option(
            help="Move its stones by a simulation: the wall by any cause, facings and tower by settlement."
        ),
    ] = None,
    small: Annotated[
        bool, typer.Option("--small", help="Smaller: the tower, and the wall with --moved settlement.")
    ] = False,
    phases: Annotated[
        bool,
        typer.Option("--phases", help="Upper courses were laid later: the wall with --moved settlement."),
    ] = False,
    scan: Annotated[
        bool, typer.Option("--scan", help="With a scan and outlines of the stones: the window.")
    ] = False,
    courses: Annotated[
        int | None, typer.Option(help="Courses of the tower; default: 40, or 12 with --small.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder for the files; default: KIND.")
    ] = None,
    json: Json = False,
) -> None:
    """Write a synthetic survey with its truth and a scene that runs, to start from."""
    from moma.cli.text.formats import as_json
    from pipelines.samples.write import write_sample

    with progress_bars() as listener:
        written = write_sample(
            kind,
            out or Path(kind),
            listener,
            moved=moved,
            small=small,
            phases=phases,
            scan=scan,
            courses=courses,
        )
    lines = [
        f"{written.title}: a synthetic survey of {written.stones} stones",
        *(f"  {path}" for path in written.files),
        "run it with",
        *(f"  {command}" for command in written.commands),
    ]
    print(as_json(asdict(written)) if json else "\n".join(lines))


@reporting
def ingest(
    files: SurveyOrCloud = None,
    format: Format = SurveyFormat.MOMA,
    header: Header = None,
    codes: Codes = None,
    kind: Kind = None,
    sigma: Sigma = None,
    unit: Unit = None,
    snap: Snap = None,
    planes: Planes = None,
    kind_where: KindWhere = None,
    support: Support = None,
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
    cloud: CloudFiles = None,
    outlines: Outlines = None,
    wall: Wall = None,
    layer: Layer = None,
    fields: Fields = None,
    outline_sigma: OutlineSigma = None,
    margin: Margin = None,
    slab: Slab = None,
    masks: Masks = None,
    size: Size = None,
    depth: Depth = None,
    review: Annotated[
        Path | None,
        typer.Option("--review", metavar="FILE.csv", help="List of the outlines that should be looked at."),
    ] = None,
    db: Db = DEFAULT_DB,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Ingest survey files into the database: all of them, or none if anything is wrong."""
    from moma.cli.text.formats import as_json
    from moma.cli.text.runs_and_surveys import ingest_lines
    from moma.kernels.beside import compiling_beside
    from pipelines.ingest.ingest import ingest as ingest_files
    from pipelines.ingest.kind_rules import kind_rules
    from pipelines.ingest.reading_options import reading_options

    if rejects is not None and not keep_going:
        raise UsageError("--rejects without --keep-going", remedy="give --keep-going too")
    for name, given in (("--unit", unit), ("--snap", snap), ("--planes", planes)):
        if given is not None and format is not SurveyFormat.SOLIDS:
            raise UsageError(f"{name} with format {format}", remedy="it is for --format solids")
    options = reading_options(header, codes, kind, sigma, unit, snap, planes)
    rules = kind_rules(kind_where or (), support or ())
    drawn = outlined(
        options,
        files,
        cloud,
        masks,
        outlines=outlines,
        wall=wall,
        layer=layer,
        fields=fields,
        outline_sigma=outline_sigma,
        margin=margin,
        slab=slab,
        size=size,
        depth=depth,
    )
    if review is not None and drawn is None:
        raise UsageError("--review without --cloud or --masks", remedy="it lists outlines")
    name, paths, options = drawn or (format.value, files or [], options)
    with compiling_beside("ingest"), progress_bars() as listener:
        report = ingest_files(
            paths,
            db,
            name,
            listener,
            options=options,
            keep_going=rejects or keep_going,
            again=again,
            rules=rules,
        )
    if review is not None:
        from pipelines.ingest.outlined import write_review

        write_review(review, [one for file in report.files for one in file.review])
    print(as_json(asdict(report)) if json else "\n".join(ingest_lines(report, verbose)))


@reporting
def survey_report(
    files: SurveyOrCloud = None,
    format: Format = SurveyFormat.MOMA,
    header: Header = None,
    codes: Codes = None,
    kind: Kind = None,
    sigma: Sigma = None,
    cloud: CloudFiles = None,
    outlines: Outlines = None,
    wall: Wall = None,
    layer: Layer = None,
    fields: Fields = None,
    outline_sigma: OutlineSigma = None,
    margin: Margin = None,
    slab: Slab = None,
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
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Judge survey files without a database: precision, courses, kinds, stones to measure again."""
    from moma.cli.text.runs_and_surveys import survey_report_lines
    from pipelines.ingest.reading_options import reading_options
    from pipelines.reports.survey.report import INDEX, report_surveys

    options = reading_options(header, codes, kind, sigma)
    drawn = outlined(
        options,
        files,
        cloud,
        None,
        outlines=outlines,
        wall=wall,
        layer=layer,
        fields=fields,
        outline_sigma=outline_sigma,
        margin=margin,
        slab=slab,
    )
    name, paths, options = drawn or (format.value, files or [], options)
    if not paths:
        raise UsageError("no survey file", remedy="name at least one")
    folder = out or Path("out") / f"survey-{(outlines or paths[0]).resolve().stem}"
    with progress_bars() as listener:
        report = report_surveys(paths, folder, name, options, listener, orthophoto)
    for warning in report.study.warnings:
        say(f"warning: {warning}")
    lines = survey_report_lines(report, verbose)
    print((folder / INDEX).read_text(encoding="utf-8").rstrip() if json else "\n".join(lines))
