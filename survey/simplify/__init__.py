"""Simplification of a surveyed stone to a hexahedron, wedge or prism.

Public: `simplify`, `BlockyStone` (simplify); `BlockShape`, `Simplified` (result); `square_face`, `SimplifyBounds`,
`SquaredFace` (squaring); `restore_worn` (worn_corners); `flatten` (flattening); `moved_corners`,
`common_share` (blockiness).
"""
