"""Point clouds with outlines of stones: from a scan and what was drawn over it to surveyed faces.

Public: `CloudOptions`, `MASONRY`, `MaskOptions`, `OutlineSettings` (settings); `open_cloud` (cloud); `open_masks`
(masks); `Wall`, `read_wall`
(wall).
"""
