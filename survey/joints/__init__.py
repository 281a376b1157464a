"""Joint closing: one plane for every two faces that meet."""
