"""Pictures of surveys, joints and results.

Public: `PICTURES` (catalogue); `draw_pictures`, `missing`, `draw_apart` (pictures); `draw_closing` (closing_pictures);
`history_svg` (plots); `DrawnCloud`, `draw_views` (cloud_views).
"""
