"""Bodies: rigid and fixed ones in arrays, deformable ones with their finite elements."""
