"""Stratigraphy: relations between units, their order in time, contradictions with dates, and GraphML.

Public: `Link`, `Order`, `check_order`, `order_of` (order); `Contradiction`, `Dated`, `contradictions`, `date_bounds`
(dates); `load_drawn`, `load_links`, `load_stones`, `load_units`, `with_years` (stored); `DrawnUnit`,
`read_graphml` (graphml); `year_bounds` (edtf); `write_graphml` (draw_graphml).
"""
