"""Rubble of one leaf: stones grown to the medial lines of the mortar between their outlines.

Public: `Leaf`, `find_leaves` (leaf); `MedialLines`, `Line`, `medial_lines` (medial_lines); `Partition`, `Edge`,
`partition` (partition); `apart`, `crosses`, `is_simple` (chains); `open_places`, `usual_width` (openings);
`GrownStones`, `grow` (grow).
"""
