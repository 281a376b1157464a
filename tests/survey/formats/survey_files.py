"""Small valid survey files of every format, as bytes."""

import csv
import re
import struct
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import meshio
import numpy as np

from tests.survey.formats.workbooks import ods, xlsx

MOMA = """\
moma-survey 1
name north wall, bay 3
observer 14.2908 29.4147 8.0771
station "S 2" 1 2 3 # by the gate
sigma 0.003
control C1 0 0 0 sigma 0.002 site 1000 2000 50
photo P1 sigma 0.8 station observer
mark P1 10 10 at 0 0 0
mark P1 90 10 at 1 0 0 sigma 0.001
mark P1 90 90 at 1 0 1
mark P1 10 90 at 0 0 1
depth header course 1-3 zone north 0.51 sigma 0.02 source broken end
depth header 0.50 sigma 0.03 source archive
depth * 0.4 source guess
canon header 0.31 0.31 sigma 0.01 source roman foot
extrude along 0 1 0 tail 0.9

stone W01-01 header course 1 zone "north wall"
  sigma 0.004
  station "S 2"
  extrude tail 0.8
  depth 0.51 sigma 0.01 source open end # sic
  note edge eroded
  vertex 10.0702 37.9656 6.8269 sigma 0.002
  vertex 10.4367 38.0115 6.8283
  vertex 10.4355 38.0102 7.1406
  point 10.1645 37.9793 6.8598
end
stone W01-02 stretcher
  photo P1
  pixel 20 20
  pixel 40 20.5
  pixel 40 60
end
stone W01-03 stretcher course 2
  vertex 0 0 0
  vertex 1 0 0
  vertex 1 0 1e0
  vertex 0 0 1
  point .5 .001 +.5
end
"""

CSV = """\
block,kind,course,role,x,y,z,sigma,depth,depth_source
A,header,1,vertex,0,0,0,0.003,0.5,"drilled, twice"
A,header,1,vertex,1.5,0,0,0.003,,
B,sill,,v,2.5,0,0,,,
A,header,1,vertex,1.5,0,1,0.004,,
# half of it
B,sill,,v,3.5,0,0,,,
B,sill,,v,3.5,0,1,,,
A,header,1,point,0.5,0.001,0.5,,,
"""

CSV_COMMAS = CSV.replace("drilled, twice", "drilled").replace(",", ";").replace(".", ",")

PNEZD = """\
Point,Northing,Easting,Elevation,Description
1,5000.123,1000.5,10.25,W01-01:v
2,5000.124,1001.5,10.25,W01-01:V
3,5000.122,1001.5,11.25,W01-01:vertex
4,5000.121,1001.0,10.75,W01-01:p
5,4990.000,1000.0,10.00,S1:s
6,5000.123,1002.5,10.25,W01-02:v
7,5000.124,1003.5,10.25,W01-02:v
8,5000.122,1003.5,11.25,W01-02:v
"""

TITLED = """\
sep=;
Aufmaß Nordwand;;;;;;;
Stein-Nr.;Steinart;Schicht;Punktart;Rechtswert [mm];Hochwert [mm];Höhe [mm];Bemerkung
A 1;Binder;1,0;v;0;0;0;"rissig; alt"
A 1;Binder;1,0;v;1500,5;0;0;
A 1;Binder;1,0;v;1500,5;0;1000;
B°2;Läufer;;v;2500;0;0;
B°2;Läufer;;v;3500;0;0;
B°2;Läufer;;p;3000;0;500;
B°2;Läufer;;v;3500;0;1000;
"""

WKT = """\
WKT,Stein,Tiefe
"POLYGON Z ((0 0 0, 1 0 0, 1 0 1, 0 0 0))",A,0.5
"LINESTRING Z (2 0 0, 3 0 0, 3 0 1, 2 0 1)",B,
"""

GSI = """\
*110001+00000000000000S1 84..00+0000000000012000 85..00-0000000000028500 86..00+0000000000007900
*110002+0000000000000101 81..00+0000000000010070 82..00+0000000000037965 83..00+0000000000006826 71....+00000000000000A1
*110003+0000000000000102 81..00+0000000000010436 82..00+0000000000038011 83..00+0000000000006828 71....+00000000000000A1
*110004+0000000000000103 81..00+0000000000010435 82..00+0000000000038010 83..00+0000000000007140 71....+00000000000000A1
*110005+0000000000000104 81..00+0000000000011435 82..00+0000000000038010 83..00+0000000000007140 71....+00000000000000B2
*110006+0000000000000105 81..00+0000000000012435 82..00+0000000000038010 83..00+0000000000007140 71....+00000000000000B2
*110007+0000000000000106 81..00+0000000000012435 82..00+0000000000038010 83..00+0000000000008140 71....+00000000000000B2
"""

LANDXML = """\
<?xml version="1.0"?>
<LandXML xmlns="http://www.landxml.org/schema/LandXML-1.2">
<Units><Metric linearUnit="meter"/></Units>
<CgPoints>
<CgPoint name="1" code="A:v">0 10 5</CgPoint>
<CgPoint name="2" code="A:v">0 11 5</CgPoint>
<CgPoint name="3" code="A:v">0.5 11 6</CgPoint>
</CgPoints>
</LandXML>
"""

JOBXML = """\
<?xml version="1.0"?>
<JOBFile><Reductions>
<Point><Name>1</Name><Code>A:v</Code><Grid><North>0</North><East>10</East><Elevation>5</Elevation></Grid></Point>
<Point><Name>2</Name><Code>A:v</Code><Grid><North>0</North><East>11</East><Elevation>5</Elevation></Grid></Point>
<Point><Name>3</Name><Code>A:v</Code><Grid><North>0.5</North><East>11</East><Elevation>6</Elevation></Grid></Point>
</Reductions></JOBFile>
"""

GEOJSON = """\
{"type": "FeatureCollection", "features": [
{"type": "Feature", "properties": {"block": "A", "depth": 0.5},
 "geometry": {"type": "Polygon", "coordinates": [[[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 0]]]}},
{"type": "Feature", "properties": {"block": "B", "depth": null},
 "geometry": {"type": "Polygon", "coordinates": [[[2, 0, 0], [3, 0, 0], [3, 0, 1], [2, 0, 0]]]}}
]}
"""

PENZD = """\
1 1000,5 5000,123 10,25 W01-01:v
2 1001,5 5000,124 10,25 W01-01:v
3 1001,5 5000,122 11,25 W01-01:v
4 1001,0 5000,121 10,75 W01-01:p
"""

CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
SQUARES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
TRIANGLES = [t for a, b, c, d in SQUARES for t in ((a, b, c), (a, c, d))]


def moved(by: float) -> list[tuple[float, float, float]]:
    return [(x + by, y, z) for x, y, z in CORNERS]


def obj() -> bytes:
    lines = ["# two stones"]
    for k, name in enumerate(("W1:header", "W2")):
        lines += [f"o {name}", *(f"v {x} {y} {z}" for x, y, z in moved(2.5 * k))]
        lines += [f"f {' '.join(f'{8 * k + i + 1}//1' for i in face)}" for face in SQUARES]
    return "\n".join(lines).encode()


def ply(form: str, faces: list[tuple[int, ...]]) -> bytes:
    places = moved(0.0) + moved(3.0)
    indices = faces + [tuple(i + 8 for i in face) for face in faces]
    head = (
        f"ply\nformat {form} 1.0\ncomment two\nelement vertex 16\nproperty float x\nproperty float y\n"
        f"property float z\nelement face {len(indices)}\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode()
    if form == "ascii":
        rows = [" ".join(map(str, row)) for row in (*places, *((len(one), *one) for one in indices))]
        return head + "\n".join(rows).encode() + b"\n"
    order = "<" if "little" in form else ">"
    body = b"".join(struct.pack(f"{order}3f", *place) for place in places)
    return head + body + b"".join(struct.pack(f"{order}B{len(one)}i", len(one), *one) for one in indices)


def stl_text() -> bytes:
    lines = []
    for k, name in enumerate(("W1", "W2")):
        lines.append(f"solid {name}")
        for triangle in TRIANGLES:
            lines += ["facet normal 0 0 0", "outer loop"]
            lines += [f"vertex {x} {y} {z}" for x, y, z in (moved(2.0 * k)[i] for i in triangle)]
            lines += ["endloop", "endfacet"]
        lines.append(f"endsolid {name}")
    return "\n".join(lines).encode()


def stl_binary() -> bytes:
    triangles = [[moved(by)[i] for i in one] for by in (0.0, 2.0) for one in TRIANGLES]
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *np.ravel(one), 0) for one in triangles)
    return b"two".ljust(80, b"\0") + struct.pack("<I", len(triangles)) + rows


def msh(version: str, binary: bool) -> bytes:
    """A brick of one hexahedron, and one of two."""
    points = [*CORNERS, *moved(3.0), (5, 0, 0), (5, 1, 0), (5, 0, 1), (5, 1, 1)]
    cells = [[0, 1, 2, 3, 4, 5, 6, 7]], [[8, 9, 10, 11, 12, 13, 14, 15], [9, 16, 17, 10, 13, 18, 19, 14]]
    mesh = meshio.Mesh(
        np.array(points, dtype=float),
        [("hexahedron", np.array(one)) for one in cells],
        cell_data={
            "gmsh:physical": [np.array([7]), np.array([8, 8])],
            "gmsh:geometrical": [np.array([1]), np.array([2, 2])],
        },
        field_data={"W1:header": np.array([7, 3]), "W2": np.array([8, 3])},
    )
    if version == "4.1":
        mesh.point_data["gmsh:dim_tags"] = np.array([[3, 1]] * 8 + [[3, 2]] * 12)
        mesh.cell_sets["gmsh:bounding_entities"] = [np.array([], dtype=np.int32)] * 2
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.msh"
        meshio.gmsh.write(path, mesh, version, binary=binary, float_fmt=".17g")
        return path.read_bytes()


def _table() -> list[list[str | float | None]]:
    """The rows of CSV as a sheet has them: numbers as numbers."""
    rows: list[list[str | float | None]] = []
    for line in csv.reader(CSV.splitlines()):
        if not line[0].startswith("#"):
            numbers = [float(one) if re.fullmatch(r"[\d.]+", one) else one or None for one in line]
            rows.append(list(numbers))
    return rows


@dataclass(frozen=True)
class Example:
    """A valid file.

    Attributes
    ----------
    format : its name for `open_survey`
    ending : of the name of the file
    data : its bytes
    codes : of the stones in it, in order
    """

    format: str
    ending: str
    data: bytes
    codes: tuple[str, ...]


EXAMPLES: Mapping[str, Example] = {
    "native": Example("moma", "moma", MOMA.encode(), ("W01-01", "W01-02", "W01-03")),
    "csv": Example("csv", "csv", CSV.encode(), ("A", "B")),
    "csv with commas": Example("csv", "csv", CSV_COMMAS.encode("latin-1"), ("A", "B")),
    "pnezd": Example("pnezd", "txt", PNEZD.encode(), ("W01-01", "W01-02")),
    "penzd": Example("penzd", "txt", PENZD.encode(), ("W01-01",)),
    "table with a title": Example("csv", "csv", TITLED.encode("cp1252"), ("A_1", "B2")),
    "table in UTF-16": Example("csv", "csv", TITLED.encode("utf-16"), ("A_1", "B2")),
    "well-known text": Example("csv", "csv", WKT.encode(), ("A", "B")),
    "workbook": Example("csv", "xlsx", xlsx({"S": _table()}), ("A", "B")),
    "workbook ods": Example("csv", "ods", ods({"S": _table()}), ("A", "B")),
    "gsi": Example("gsi", "gsi", GSI.replace("00A1", "A1:v").replace("00B2", "B2:v").encode(), ("A1", "B2")),
    "landxml": Example("landxml", "xml", LANDXML.encode(), ("A",)),
    "jobxml": Example("jobxml", "jxl", JOBXML.encode(), ("A",)),
    "geojson": Example("geojson", "geojson", GEOJSON.encode(), ("A", "B")),
    "obj": Example("solids", "obj", obj(), ("W1", "W2")),
    "ply": Example("solids", "ply", ply("ascii", SQUARES), ("m-1", "m-2")),
    "ply little": Example("solids", "ply", ply("binary_little_endian", TRIANGLES), ("m-1", "m-2")),
    "ply big": Example("solids", "ply", ply("binary_big_endian", SQUARES), ("m-1", "m-2")),
    "stl": Example("solids", "stl", stl_text(), ("W1", "W2")),
    "stl binary": Example("solids", "stl", stl_binary(), ("m-1", "m-2")),
    "msh 2": Example("solids", "msh", msh("2.2", False), ("W1", "W2")),
    "msh 2 binary": Example("solids", "msh", msh("2.2", True), ("W1", "W2")),
    "msh 4": Example("solids", "msh", msh("4.1", False), ("W1", "W2")),
    "msh 4 binary": Example("solids", "msh", msh("4.1", True), ("W1", "W2")),
}
"""Valid files by name; solids are named after their file, m."""
