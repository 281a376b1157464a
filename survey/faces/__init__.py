"""Stone faces: measured points → robust plane → outline.

Public: `fit_plane`, `FaceFit` (planes); `outline_face`, `Face` (faces); `judge_shape`, `FaceShape` (shapes);
`common_plane`, `PlaneEstimate` (common_planes); `estimate_roughness` (roughness);
`Neighbours` (neighbours); `outline_polygon` (outline).
"""
