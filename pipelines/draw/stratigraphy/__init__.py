"""The stratigraphy of a database: its order with dates and contradictions, and the matrix drawn.

Public: `Matrix`, `draw`, `study`, `matrix_page` (matrix); `matrix_svg` (drawing).
"""
