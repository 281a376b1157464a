"""Missing stones: gaps, openings and arches.

Public: `propose_missing`, `MissingStone` (propose); `MissingSettings` (settings); `find_gaps`, `find_holes` (gaps);
`arch_gaps` (arches); `frame_gaps` (openings); `likeliest`, `depth_of_kind` (kinds); `elevations`, `Elevation` (sides).
"""
