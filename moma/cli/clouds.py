"""Options of point clouds with outlines, and the command that draws a cloud."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from moma.cli.console import reporting, say
from moma.cli.options import Json
from moma.cli.progress import progress_bars
from moma.errors import UsageError

if TYPE_CHECKING:
    from survey.formats.options import ReadingOptions

__all__ = [
    "CloudFiles",
    "Depth",
    "Fields",
    "Layer",
    "Margin",
    "Masks",
    "OutlineSigma",
    "Outlines",
    "Size",
    "Slab",
    "Wall",
    "cloud",
    "outlined",
]

_PANEL = "Point clouds and masks"

CloudFiles = Annotated[
    list[Path] | None,
    typer.Option(
        "--cloud",
        metavar="FILE",
        help="Point cloud: LAS, LAZ, E57, PLY, XYZ or PTS; may be repeated.",
        rich_help_panel=_PANEL,
    ),
]
Outlines = Annotated[
    Path | None,
    typer.Option(
        "--outlines",
        metavar="FILE",
        help="Outlines of its stones: GeoPackage, GeoJSON, Shapefile, DXF, label PNG or TIFF, COCO JSON.",
        rich_help_panel=_PANEL,
    ),
]
Wall = Annotated[
    str | None,
    typer.Option(
        "--wall",
        metavar="FRAME",
        help='Frame of the plane of the outlines: FILE.toml, or two points on the wall\'s foot, "X,Y X,Y".',
        rich_help_panel=_PANEL,
    ),
]
Layer = Annotated[
    str | None,
    typer.Option(
        "--layer",
        metavar="NAME",
        help="Layer of the outlines, if the file has several.",
        rich_help_panel=_PANEL,
    ),
]
Fields = Annotated[
    str | None,
    typer.Option(
        "--fields",
        metavar="MAP",
        help="Attributes of outlines by meaning, e.g. 'code=Stein_Nr,course=Lage'.",
        rich_help_panel=_PANEL,
    ),
]
OutlineSigma = Annotated[
    float | None,
    typer.Option(
        "--outline-sigma",
        metavar="S",
        help="Standard deviation of a drawn corner in metres; default: 0.005.",
        rich_help_panel=_PANEL,
    ),
]
Margin = Annotated[
    float | None,
    typer.Option(
        "--margin",
        metavar="T",
        help="Points nearer to an outline than this are left out; default: three times its sigma.",
        rich_help_panel=_PANEL,
    ),
]
Slab = Annotated[
    float | None,
    typer.Option(
        "--slab",
        metavar="T",
        help="Points farther from the plane of an outline are not of its stone; default: 0.15.",
        rich_help_panel=_PANEL,
    ),
]
Masks = Annotated[
    Path | None,
    typer.Option(
        "--masks",
        metavar="FILE",
        help="Label picture or COCO JSON without a cloud: one plane face for each stone.",
        rich_help_panel=_PANEL,
    ),
]
Size = Annotated[
    str | None,
    typer.Option(
        "--size",
        metavar="WxH",
        help="Width and height of the picture in metres, e.g. 1.0x1.2.",
        rich_help_panel=_PANEL,
    ),
]
Depth = Annotated[
    float | None,
    typer.Option(
        "--depth", metavar="D", help="Depth of all masked stones in metres.", rich_help_panel=_PANEL
    ),
]


def outlined(
    base: "ReadingOptions",
    files: list[Path] | None,
    clouds: list[Path] | None,
    masks: Path | None,
    **given: object,
) -> "tuple[str, list[Path], ReadingOptions] | None":
    """Return format, files and options of a cloud with outlines or of masks; None if neither is given.

    Raises
    ------
    UsageError
        if options contradict each other, or are of another format
    """
    named = {f"--{name.replace('_', '-')}": value for name, value in given.items() if value is not None}
    if clouds is None and masks is None:
        for name in named:
            what = f"{name} without --cloud" + (" or --masks" if name in ("--wall", "--fields") else "")
            remedy = (
                "give --masks too"
                if name in ("--size", "--depth")
                else "give --cloud FILE and --outlines FILE"
            )
            raise UsageError(
                what if name not in ("--size", "--depth") else f"{name} without --masks", remedy=remedy
            )
        return None
    if files or (clouds and masks):
        other = "--masks" if clouds and masks else "survey files"
        raise UsageError(
            f"{other} beside --{'cloud' if clouds else 'masks'}", remedy="ingest one after the other"
        )
    from pipelines.ingest.outlined import cloud_options, mask_options

    fitting = ("size", "depth", "wall", "fields") if masks else _OF_CLOUDS
    for name in named:
        if name.strip("-").replace("-", "_") not in fitting:
            raise UsageError(f"{name} with --{'masks' if masks else 'cloud'}", remedy="leave it out")
    if masks is not None:
        chosen = {"chosen" if name == "fields" else name: given[name] for name in fitting}
        return "masks", [masks], mask_options(base, **chosen)  # type: ignore[arg-type]
    if given["outlines"] is None:
        raise UsageError(
            "--cloud without --outlines", remedy="name the outlines of its stones: --outlines FILE"
        )
    chosen = {"chosen" if name == "fields" else name: given[name] for name in fitting}
    return "cloud", list(clouds or ()), cloud_options(base, **chosen)  # type: ignore[arg-type]


_OF_CLOUDS = ("outlines", "wall", "layer", "fields", "outline_sigma", "margin", "slab")


@reporting
def cloud(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE…", help="Point clouds: LAS, LAZ, E57, PLY, XYZ or PTS.")
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
    from pipelines.clouds.views import draw_views

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
