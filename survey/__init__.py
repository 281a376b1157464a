"""Pillar 1: ASCII surveys → planes → faces → extruded blocks → stones that touch.

formats       readers of survey files → records
records       content of a survey file
clouds        point clouds with outlines, and masks → records
registration  survey frames and photographs → site frame; records → stones in it
orientation   photographs → orientation, and points from marks on them
faces         points → plane → outlined face
extrusion     face and depth → solid block
statistics    robust scale and roots, on which all others stand
geometry      closed solids: cutting, convex parts, adjacency, repair
simplify      solid block → hexahedron, wedge or prism
joints        blocks a joint apart → stones that share contact planes
quality       report on precision, courses and contradictions
unseen        proposals for the core of walls and for missing stones
"""

import ground.kernels  # noqa: F401 - before numba
