"""Closed solids: OBJ, PLY, STL and MSH."""
