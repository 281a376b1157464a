"""Quality of masonry: the line of minimum trace, bonding through the wall, and the masonry quality index.

Public: `minimum_traces`, `section_trace` (trace); `Grade`, `index_range`, `mechanical_ranges` (index);
`judge_masonry`, `WallStone`, `MasonryQuality` (walls).
"""
