"""Files of photogrammetric programs that are not read, known by how they begin, with the way out."""

import re
from pathlib import Path

from ground.errors import SurveyError

_HEAD = 4096  # bytes in which a file tells what it is
_MARKS = (
    "write its marks as a table (photograph, point, x, y in pixels from the upper left corner), and its camera under "
    "[[cameras]]"
)
_COLMAP = "export the model in COLMAP's format{how}, and name its folder: colmap = DIR"
_PROGRAMS = (
    (rb"\A# Bundle file v", "a model of Bundler", _MARKS),
    (rb"\A\s*fileName imageWidth imageHeight|pix4d", "a file of Pix4D",
     "export it from PIX4Dmatic as OPF, convert that by opf2colmap of pyopf, and name its folder: colmap = DIR"),
    (rb"\A#name,x,y,(?:alt|z)|\A#cameras \d|xcr:|<RealityCapture", "a file of RealityCapture",
     _COLMAP.format(how=" (Alignment, Registration, COLMAP)")),
    (rb"<(?:ExportAPERO|OrientationConique|CalibrationInternConique|SetOfMesureAppuisFlottants|DicoAppuisFlottant)\b",
     "a file of MicMac", _MARKS),
    (rb"!!opencv-matrix|<opencv_storage", "a calibration of OpenCV",
     "name it under [[cameras]], with calibration = FILE, beside a table of marks"),
    (rb"<calibration>\s*<projection>", "a calibration of Metashape",
     "give the XML of its cameras (File, Export, Export Cameras): metashape = FILE"),
    (rb'"sfm_data_version"', "a model of OpenMVG", _COLMAP.format(how=" by openMVG_main_openMVG2Colmap")),
    (rb'"shots"\s*:|"rig_instances"\s*:', "a model of OpenSfM", _COLMAP.format(how=" by opensfm export_colmap")),
    (rb'"featuresFolders"|"viewId"', "a model of Meshroom", _COLMAP.format(how=" by aliceVision_exportColmap")),
)  # fmt: skip
"""How a file begins, what it is, and the way out."""

_ENDINGS = {
    ".p4d": _PROGRAMS[1][1:],
    ".rcproj": _PROGRAMS[2][1:],
    ".psx": ("a project of Metashape",
             "export its cameras (File, Export, Export Cameras, Agisoft XML): metashape = FILE"),
}  # fmt: skip
_ENDINGS[".psz"] = _ENDINGS[".psx"]


def refuse_other_programs(path: Path) -> None:
    """Refuse a file of a program that is not read, by name.

    Raises
    ------
    SurveyError
        naming the program and the way out
    """
    if not path.is_file():
        return
    named = _ENDINGS.get(path.suffix.lower())
    if named is None:
        with path.open("rb") as file:
            head = file.read(_HEAD)
        named = next(((what, out) for mark, what, out in _PROGRAMS if re.search(mark, head)), None)
    if named is not None:
        what, remedy = named
        raise SurveyError(f"is {what}, which is not read", where=str(path), remedy=remedy)
