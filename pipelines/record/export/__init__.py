"""Buildings written for other programs: IFC, DXF, GeoPackage, glTF, COMPAS, and scripts for LMGC90 and 3DEC.

A file goes by its ending. The same database gives the same bytes: what has to carry a date carries that of the latest
entry, and every identifier follows from the code of a stone.

`moma_solve` is for COMPAS what `moma run` is here.

Public: `Exported`, `export_file` (export); `Building`, `Group`, `read_building` (building); `moma_solve`
(compas_solve); `read_problem` (compas_problem).
"""
