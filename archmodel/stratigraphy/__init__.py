"""Stratigraphy: relations between units, their order in time, contradictions with dates, and GraphML.

Public: `Link`, `Order`, `check_order`, `order_of` (order); `load_links`, `load_stones`, `load_units` (stored);
`Contradiction`, `Dated`, `contradictions`, `date_bounds` (dates); `read_graphml`, `write_graphml` (graphml).
"""
