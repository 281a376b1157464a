"""Points and corners of stones from marks on oriented photographs.

Public: `located_stones` (marked_stones); `intersect` (intersection); `plot` (plotting); `fit_surface` (surfaces).
"""
