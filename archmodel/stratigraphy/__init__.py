"""Stratigraphy: relations between units, their order in time, contradictions with dates, the matrix and its files.

Public: `Link`, `Order`, `check_order`, `order_of` (order); `load_links`, `load_dates` (stored); `Contradiction`,
`contradictions`, `date_bounds` (dates); `Matrix`, `draw`, `study` (report); `matrix_svg` (drawing); `matrix_page`
(page); `read_graphml`, `write_graphml` (graphml).
"""
