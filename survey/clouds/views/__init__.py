"""Views of point clouds: orthophotos, depth maps and sections.

Public: `Picture`, `find_wall`, `paint_wall`, `write_picture` (orthophoto); `Section`, `section_plane` (sections).
"""
