"""Closed solids with planar faces: cutting, convex parts, adjacency, folds, repair.

Public: `BOX`, `Solid`, `plane_frame`, `volume_of` (solids); `SolidArrays`, `Touching`, `find_touching` (adjacency);
`cut_stones`, `CutStone` (cutting); `convex_parts` (convex_parts); `stone_parts` (stone_parts); `is_convex`,
`reflex_edges` (convexity); `intersection` (half_spaces); `fold`, `warp` (folds); `settle` (plane_network);
`check_watertight`, `triangulate` (watertight).
"""
