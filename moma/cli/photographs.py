"""Command that orients photographs."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from moma.cli.console import reporting, say
from moma.cli.options import Json, Verbose
from moma.errors import UsageError

__all__ = ["orient"]


class Blunders(StrEnum):
    """Treatment of marks that the test finds wrong."""

    REPORT = "report"
    REMOVE = "remove"


@reporting
def orient(
    project: Annotated[
        Path | None, typer.Argument(metavar="PROJECT.toml", help="Project file; see docs/howto/photographs.md.")
    ] = None,
    photomodeler: Annotated[
        Path | None, typer.Option("--photomodeler", metavar="FILE", help="Text export of PhotoModeler, without a project file.")
    ] = None,
    control: Annotated[
        Path | None, typer.Option("--control", metavar="FILE", help="Control points: number, name, X, Y, Z, deviations.")
    ] = None,
    calibrate: Annotated[
        str | None,
        typer.Option("--calibrate", metavar="LIST", help="Parameters of the camera that are estimated, e.g. c,xp,yp,K1,K2."),
    ] = None,
    fixed_control: Annotated[
        bool, typer.Option("--fixed-control", help="Control points keep their places, whatever their deviations.")
    ] = False,
    check: Annotated[
        str | None, typer.Option("--check", metavar="LIST", help="Control points that only check the result.")
    ] = None,
    blunders: Annotated[
        Blunders | None, typer.Option(help="Whether marks that the test finds wrong are left out; default: report.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder for the results; default: out/PROJECT.")
    ] = None,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Orient photographs: bundle adjustment with calibration, precision of every point, blunders."""
    from moma.cli.text.formats import as_json
    from moma.cli.text.photographs import orient_lines
    from pipelines.orient.orient import orient_photographs, photomodeler_project
    from pipelines.orient.project import read_project

    if (project is None) == (photomodeler is None):
        raise UsageError("neither or both of PROJECT.toml and --photomodeler", remedy="give one of them")
    if project is not None:
        for name, given in (
            ("--control", control), ("--calibrate", calibrate), ("--fixed-control", fixed_control or None),
            ("--check", check), ("--blunders", blunders),
        ):  # fmt: skip
            if given is not None:
                raise UsageError(f"{name} with a project file", remedy="write it into the project file")
        read = read_project(project)
    else:
        assert photomodeler is not None
        read = photomodeler_project(
            photomodeler, control, _names(calibrate), fixed_control, _names(check), (blunders or Blunders.REPORT).value
        )
    folder = out or Path("out") / (project or photomodeler or Path("photographs")).stem
    report = orient_photographs(read, folder)
    for remark in report.values["remarks"]:
        say(f"warning: {remark}")
    left = ("covariance", "marks")
    shown = {name: value for name, value in report.values.items() if name not in left}
    print(as_json({**shown, "folder": str(folder)}) if json else "\n".join(orient_lines(report, verbose)))


def _names(text: str | None) -> tuple[str, ...]:
    return tuple(one.strip() for one in text.split(",") if one.strip()) if text else ()
