"""Transformation from survey frames and photographs to the site frame; the chain from records to stones in it.

Public: `fit_similarity`, `SiteTransform`, `to_site`, `record_to_site` (site_frame); `fit_homography`, `Homography`
(homography); `wall_of_marks`, `MarkedWall` (marked_walls); `lift_faces`, `LiftedFace` (photographed_stones);
`survey_stones`, `SurveyedStream` (stones).
"""
