"""Commands that propose stones: unseen ones, and outlines from a picture."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from ground.errors import UsageError
from moma.cli.console import reporting, say
from moma.cli.options import Common, Json
from moma.cli.progress import progress_bars

if TYPE_CHECKING:
    from pipelines.propose.propose import ProposalReport


Subject = Literal["missing", "infill"]
"""Subjects of proposals."""


CoreShape = Literal["blocks", "storeys"]
"""Shapes of the core of a wall."""


@dataclass(frozen=True)
class _CoreChoices:
    """Form of the core of a wall."""

    shape: Annotated[
        CoreShape | None,
        typer.Option("--as", help="The core as blocks, or as one continuum per storey; default: blocks."),
    ] = None
    storey_height: Annotated[
        float | None,
        typer.Option(
            "--storey-height", metavar="M", help="Height of a storey in metres; default: the whole wall."
        ),
    ] = None
    facings: Annotated[
        tuple[str, str] | None,
        typer.Option("--facings", metavar="EXPR EXPR", help="Two facings of one wall; default: recognised."),
    ] = None


@reporting
def propose(
    *,
    what: Annotated[
        Subject, typer.Argument(metavar="missing|infill", help="Missing stones, or the core of walls.")
    ],
    where: Annotated[
        list[str] | None,
        typer.Option(
            "--where",
            metavar="EXPR",
            help="Only with stones for which this holds; if repeated, all must hold.",
        ),
    ] = None,
    core: _CoreChoices,
    record: Annotated[
        bool, typer.Option("--record", help="Record them in the database, as hypotheses.")
    ] = False,
    author: Annotated[
        str | None, typer.Option("--author", metavar="NAME", help="Author of the record.")
    ] = None,
    source: Annotated[
        str | None, typer.Option("--source", metavar="TEXT", help="Grounds; default: those of each proposal.")
    ] = None,
    common: Common,
) -> None:
    """Propose missing stones, or the core between two facings; see docs/unseen.md."""
    from moma.cli.text.formats import as_json
    from pipelines.propose.propose import Recording, propose_core, propose_stones
    from survey.unseen.core.settings import InfillSettings, InfillShape

    options = {"--as": core.shape, "--storey-height": core.storey_height, "--facings": core.facings}
    _refuse_others(what, options, core.shape, record, author, source)
    recording = Recording(author, source) if record else None
    if what == "missing":
        report = propose_stones(common.db, where or (), recording=recording)
    else:
        settings = InfillSettings(shape=InfillShape(core.shape or "blocks"), storey_height=core.storey_height)
        report = propose_core(common.db, where or (), settings, recording, facings=core.facings)
    if common.json:
        print(as_json(asdict(report)))
        return
    if report.proposals:
        print(_table(report))
    if common.verbose:
        for proposal in report.proposals:
            print("\n".join([f"{proposal.code}: {proposal.evidence}", f"  depth: {proposal.depth_source}"]))
    say(_summary(report, record))


def _refuse_others(
    what: Subject,
    options: Mapping[str, object],
    shape: CoreShape | None,
    record: bool,
    author: str | None,
    source: str | None,
) -> None:
    """Refuse options that exclude each other."""
    if what == "missing":
        for name, value in options.items():
            if value is not None:
                raise UsageError(f"{name} is for the core of walls", remedy="leave it out, or propose infill")
    height = options["--storey-height"]
    if height is not None and shape != "storeys":
        raise UsageError("--storey-height is for storeys", remedy="give --as storeys too")
    if isinstance(height, float) and not height > 0.0:
        raise UsageError(f"--storey-height is {height:g} m", remedy="give a height above zero")
    if not record and (author is not None or source is not None):
        name = "--author" if author is not None else "--source"
        raise UsageError(f"{name} is for what is recorded", remedy="give --record too")


def _table(report: "ProposalReport") -> str:
    from moma.cli.text.formats import as_table

    columns = ("code", "kind", "course", "length", "height", "depth", "volume", "notes")
    rows = [{**asdict(proposal), "notes": "; ".join(proposal.notes) or None} for proposal in report.proposals]
    shown = {
        name: {"length": "m", "height": "m", "depth": "m", "volume": "m³"}.get(name)
        for name in columns
        if any(row[name] is not None for row in rows)
    }
    return as_table(shown, rows)


def _summary(report: "ProposalReport", record: bool) -> str:
    count = len(report.proposals)
    if not count:
        return f"nothing to propose among {report.stones} stones"
    text = f"{count} proposal{'s' if count > 1 else ''} from {report.stones} stones"
    volume = sum(proposal.volume for proposal in report.proposals)
    if report.what == "infill":
        text += f", {volume:.3f} m³"
    if report.entry is None:
        return f"{text}; nothing is recorded: give --record" if not record else text
    text += f"; recorded as entry {report.entry}"
    return text if report.related is None else f"{text}, relations recomputed as entry {report.related}"


MasonryKind = Literal["auto", "ashlar", "coursed", "brick", "rubble"]
"""Kinds of masonry in a picture."""


@dataclass(frozen=True)
class _PictureChoices:
    """Scale, kind and corrections of a picture."""

    pixel: Annotated[
        float | None,
        typer.Option("--pixel", metavar="T", help="Side of a pixel in metres, without a world file."),
    ] = None
    size: Annotated[
        str | None,
        typer.Option(
            "--size", metavar="WxH", help="Width and height of the picture in metres, e.g. 4.8x3.9."
        ),
    ] = None
    mask: Annotated[
        Path | None,
        typer.Option(
            "--mask", metavar="FILE", help="Picture of the same size, white where there is no wall."
        ),
    ] = None
    depth_map: Annotated[
        Path | None,
        typer.Option(
            "--depth-map",
            metavar="FILE",
            help="Depth map of moma cloud; default: the one beside its wall.png.",
        ),
    ] = None
    joint: Annotated[
        float | None,
        typer.Option("--joint", metavar="T", help="Width of the joints in metres; default: by itself."),
    ] = None
    masonry: Annotated[MasonryKind, typer.Option(help="Kind of masonry.")] = "auto"
    review: Annotated[
        Path | None,
        typer.Option(
            "--review",
            metavar="FILE",
            help="Open these outlines instead, and mark what the picture contradicts.",
        ),
    ] = None
    corrected: Annotated[
        Path | None,
        typer.Option("--corrected", metavar="FILE", help="Take back what the page saved."),
    ] = None


@reporting
def outlines(
    *,
    picture: Annotated[
        Path, typer.Argument(metavar="PICTURE", help="Orthophoto: PNG, JPEG, TIFF; wall.png of moma cloud.")
    ],
    asked: _PictureChoices,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for the files; default: out/outlines-PICTURE."),
    ] = None,
    json: Json = False,
) -> None:
    """Propose the outlines of stones from a picture, with a page to correct them."""
    from moma.cli.text.formats import as_json
    from pipelines.ingest.outlined import size_of
    from pipelines.propose.outlines.draw import OutlineRequest, draw_outlines

    request = OutlineRequest(
        picture,
        asked.pixel,
        None if asked.size is None else size_of(asked.size),
        asked.mask,
        asked.depth_map,
        asked.joint,
        asked.masonry,
        asked.review,
        asked.corrected,
    )
    folder = out or Path("out") / f"outlines-{picture.stem}"
    with progress_bars() as listener:
        drawn = draw_outlines(request, folder, listener)
    for doubt in drawn.doubts:
        say(f"warning: {doubt}")
    kinds = ", ".join(f"{count} {kind}" for kind, count in drawn.kinds.items())
    courses = f" in {drawn.courses} courses" if drawn.courses else ""
    lines = [
        f"{picture}: nothing is proposed"
        if drawn.refused
        else f"{picture}: {drawn.stones} stones{courses} ({kinds})",
        f"  {drawn.masonry}, joints {drawn.joint * 1e3:.0f} mm, openings: {drawn.openings}, doubtful: {drawn.doubtful}",
        *([f"  by hand: {drawn.corrected}, superseded: {len(drawn.superseded)}"] if asked.corrected else []),
        *(f"  {path}" for path in drawn.files),
    ]
    print(as_json(asdict(drawn)) if json else "\n".join(lines))
    if drawn.refused:
        raise typer.Exit(1)
