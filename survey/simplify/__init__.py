"""Simplification of a surveyed stone to a hexahedron, wedge or prism.

Public: `simplify`, `BlockyStone`, `BlockShape`, `Simplified`, `SimplifyBounds` (simplify); `square_face`, `SquaredFace`
(squaring); `restore_worn` (worn_corners); `flatten` (flattening); `moved_corners`, `common_share` (blockiness).
"""
