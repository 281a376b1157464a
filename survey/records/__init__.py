"""Records of a survey file, before anything is computed.

Public: `BlockRecord`, `SolidRecord`, `Reject`, `Survey`, `SurveyHead`, `SurveyStream`, `DepthRule`,
`Extrusion` (survey); `Snapping` (snapping); `doubt_of`, `LENGTH`, `DENSITY`,
`YOUNG`, `POISSON`, `FRICTION` (plausible).
"""
