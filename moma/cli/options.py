"""Options and arguments shared by several commands; a command takes a group of them as one dataclass."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from ground.errors import UsageError

DEFAULT_DB = "sqlite:///moma.db"


def check_ending(file: Path | None, *endings: str) -> None:
    """Check that the name of a file to be written ends as the format in which it is written; None: nothing is written.

    Raises
    ------
    UsageError : it has another ending
    """
    if file is not None and not file.name.lower().endswith(endings):
        raise UsageError(
            f"no format that is written here has the ending {''.join(file.suffixes[-1:])!r}",
            where=str(file),
            remedy=f"give a name that ends in {' or '.join(endings)}",
        )


SurveyFormat = Literal["moma", "csv", "pnezd", "penzd", "gsi", "jobxml", "landxml", "geojson", "solids"]
"""Formats of survey files."""


UpAxis = Literal["y", "z"]
"""Axes that may point upwards."""


ListFormat = Literal["table", "csv", "json", "geojson"]
"""Formats of a list of entities."""


ProfileName = Literal["fast", "balanced", "accurate"]
"""Names in pipelines.tuning.profiles, which is not loaded for a help text."""


Db = Annotated[
    str,
    typer.Option(
        "--db",
        metavar="URL",
        envvar="MOMA_DB",
        help="Entity database: sqlite:///FILE, or postgresql://USER@HOST/NAME.",
    ),
]
StoreDb = Annotated[
    str | None,
    typer.Option(
        "--db",
        metavar="URL",
        envvar="MOMA_DB",
        help="Keep the run in this database too; it is made if it is not there. Default: results in files only.",
        show_default=False,
    ),
]
Profile = Annotated[
    ProfileName | None,
    typer.Option(
        "--profile",
        help="Named settings that override the scene's; see docs/runs.md. Default: the scene as written.",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")]
Verbose = Annotated[bool, typer.Option("-v", "--verbose", help="Print more; show the traceback of an error.")]
Sheet = Annotated[
    str | None, typer.Option("--sheet", metavar="NAME", help="Sheet of a workbook (XLSX, ODS) with several.")
]
At = Annotated[
    str | None,
    typer.Option(
        "--at",
        metavar="WHEN",
        help="As it was known when an entry was made, by its number, or at the end of a day: 2024-03-15.",
    ),
]
SceneArgument = Annotated[Path, typer.Argument(metavar="SCENE.toml", help="Scene file; see docs/scene.md.")]
Out = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Folder for the results; default: out/SCENE.")
]
Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="Replace the results of another scene in the folder.")
]
Resume = Annotated[
    bool | None,
    typer.Option(
        "--resume/--restart",
        help="Go on with the unfinished run in the folder, or give it up; without either, it is left alone.",
        show_default=False,
    ),
]
AcceptUnsound = Annotated[
    bool,
    typer.Option(
        "--accept-unsound", help="Run a scene that moma check finds unsound; mark all results accordingly."
    ),
]

_PANEL = "Point clouds and masks"


@dataclass(frozen=True)
class Common:
    """Options of most commands: the database, and how much is printed, for whom."""

    db: Db = DEFAULT_DB
    json: Json = False
    verbose: Verbose = False


@dataclass(frozen=True)
class SurveyChoices:
    """Survey files, and how tables and lists of points are read."""

    files: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="FILE…",
            help="Survey files, or folders of them; see docs/formats.md. None with --cloud or --masks.",
        ),
    ] = None
    format: Annotated[
        SurveyFormat | None,
        typer.Option(help="Format of the survey files; default: by their endings.", show_default=False),
    ] = None
    header: Annotated[
        Path | None,
        typer.Option(
            "--header", metavar="FILE", help="Header (stations, control, depths) for formats without one."
        ),
    ] = None
    columns: Annotated[
        str | None,
        typer.Option(
            "--columns",
            metavar="MAP",
            help="Columns of a table that are not recognised, e.g. 'block=Stein,x=Rechts,ignore=Datum'.",
        ),
    ] = None
    sheet: Sheet = None
    codes: Annotated[
        str | None,
        typer.Option("--codes", metavar="TEMPLATE", help="Parts of a point code, e.g. '{block}:{role}'."),
    ] = None
    kind: Annotated[
        str | None,
        typer.Option("--kind", metavar="KIND", help="Kind of stones without one; default: ashlar."),
    ] = None
    kinds: Annotated[
        str | None,
        typer.Option(
            "--kinds",
            metavar="TABLE",
            help="Abbreviations of kinds, e.g. 'SPR=springer,VOU=voussoir', or a file.",
        ),
    ] = None
    roles: Annotated[
        str | None,
        typer.Option(
            "--roles",
            metavar="WORDS",
            help="Words for roles of points (vertex, point, station, control), e.g. 'Fl=point,HP=control'.",
        ),
    ] = None
    sigma: Annotated[
        float | None,
        typer.Option(
            "--sigma",
            metavar="S",
            help="Standard deviation of a coordinate in metres, where the file gives none.",
        ),
    ] = None
    unit: Annotated[
        str | None,
        typer.Option(
            "--unit",
            metavar="UNIT",
            help="Unit of coordinates, with --cloud of the outlines: m, dm, cm, mm, ft or in; default: m, or as the "
            "file says.",
        ),
    ] = None


@dataclass(frozen=True)
class SolidChoices:
    """Options of files of solids."""

    up: Annotated[
        UpAxis | None,
        typer.Option(
            "--up", help="Axis that points upwards in files of solids; default: z.", show_default=False
        ),
    ] = None
    repair: Annotated[
        float | None,
        typer.Option(
            "--repair",
            metavar="T",
            help="Repair open edges and the like of solids within T metres; 0: nothing; default: 10⁻⁵ of their size.",
        ),
    ] = None
    snap: Annotated[
        float | None,
        typer.Option(
            "--snap",
            metavar="T",
            help="Bring matching faces of neighbouring solids within T metres into one plane, e.g. 0.002.",
        ),
    ] = None
    planes: Annotated[
        float | None,
        typer.Option(
            "--planes",
            metavar="T",
            help="Facets of a scanned solid within T metres of a plane are one face; 0: keep all; default: 0.005.",
        ),
    ] = None
    kind_where: Annotated[
        list[str] | None,
        typer.Option(
            "--kind-where",
            metavar="RULE",
            help="Kind of solids by rule, e.g. 'voussoir: z > 0.5'; may be repeated, the last match counts.",
        ),
    ] = None
    support: Annotated[
        list[str] | None,
        typer.Option(
            "--support",
            metavar="EXPR",
            help="Solids that are supports, e.g. 'z < 0.01', z being the lowest corner; may be repeated.",
        ),
    ] = None


@dataclass(frozen=True)
class CloudChoices:
    """Point clouds with outlines of their stones."""

    cloud: Annotated[
        list[Path] | None,
        typer.Option(
            "--cloud",
            metavar="FILE",
            help="Point cloud: LAS, LAZ, E57, PTX, PLY, PCD, XYZ or PTS; may be repeated.",
            rich_help_panel=_PANEL,
        ),
    ] = None
    outlines: Annotated[
        Path | None,
        typer.Option(
            "--outlines",
            metavar="FILE",
            help="Outlines of its stones: GeoPackage, GeoJSON, Shapefile, DXF, CSV, label PNG or TIFF, COCO or plain "
            "JSON; with --depth, without a cloud.",
            rich_help_panel=_PANEL,
        ),
    ] = None
    wall: Annotated[
        str | None,
        typer.Option(
            "--wall",
            metavar="FRAME",
            help='Frame of the plane of the outlines: FILE.toml, or two points on the wall\'s foot, "X,Y X,Y".',
            rich_help_panel=_PANEL,
        ),
    ] = None
    layer: Annotated[
        str | None,
        typer.Option(
            "--layer",
            metavar="NAME",
            help="Layer of the outlines, if the file has several; "
            "number or colour of the stones in a picture of classes.",
            rich_help_panel=_PANEL,
        ),
    ] = None
    chosen: Annotated[
        str | None,
        typer.Option(
            "--fields",
            metavar="MAP",
            help="Attributes of outlines by meaning, e.g. 'code=Stein_Nr,course=Lage'.",
            rich_help_panel=_PANEL,
        ),
    ] = None
    outline_sigma: Annotated[
        float | None,
        typer.Option(
            "--outline-sigma",
            metavar="S",
            help="Standard deviation of a drawn corner in metres; default: 0.005, or 0.001 without a cloud.",
            rich_help_panel=_PANEL,
        ),
    ] = None
    margin: Annotated[
        float | None,
        typer.Option(
            "--margin",
            metavar="T",
            help="Points nearer to an outline than this are left out; default: three times its sigma.",
            rich_help_panel=_PANEL,
        ),
    ] = None
    slab: Annotated[
        float | None,
        typer.Option(
            "--slab",
            metavar="T",
            help="Points farther from the plane of an outline are not of its stone; default: 0.15.",
            rich_help_panel=_PANEL,
        ),
    ] = None


@dataclass(frozen=True)
class DrawnChoices(CloudChoices):
    """Point clouds with outlines, and masks or outlines alone."""

    masks: Annotated[
        Path | None,
        typer.Option(
            "--masks",
            metavar="FILE",
            help="Label picture or COCO JSON without a cloud: one plane face for each stone.",
            rich_help_panel=_PANEL,
        ),
    ] = None
    size: Annotated[
        str | None,
        typer.Option(
            "--size",
            metavar="WxH",
            help="Width and height in metres, e.g. 1.0x1.2: "
            "of the picture, or of the wall from the origin of outlines.",
            rich_help_panel=_PANEL,
        ),
    ] = None
    depth: Annotated[
        float | None,
        typer.Option(
            "--depth",
            metavar="D",
            help="Depth in metres of all stones without a cloud.",
            rich_help_panel=_PANEL,
        ),
    ] = None
