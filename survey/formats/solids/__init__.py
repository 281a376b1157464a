"""Closed solids: OBJ, PLY, STL and MSH.

Public: `open_solids` (reader); `closed_bodies`, `RawBody`, `ClosedBody` (bodies); `write_obj` (obj_writer).
"""
