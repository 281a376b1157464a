"""The hidden side of a measured stone: depth rules and extrusion along the normal."""
