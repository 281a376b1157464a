"""Simplification of a surveyed stone to a hexahedron, wedge or prism."""
