"""Closed solids: OBJ, PLY, STL, MSH, models of COMPAS and LMGC90.

Public: `open_solids` (reader); `closed_bodies`, `RawBody`, `ClosedBody` (bodies); `read_compas`,
`CompasBlock`, `CompasModel` (compas).
"""
