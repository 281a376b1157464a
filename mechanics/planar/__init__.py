"""The plane: disks and straight walls, with the laws and solvers of the stones."""
