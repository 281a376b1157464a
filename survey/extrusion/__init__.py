"""The hidden side of a stone: depth rules and extrusion along the normal; the chain from records to stones.

Public: `depth_for`, `Depth` (depth); `extrude`, `prism`, `SurveyedBlock` (extrusion); `block_of_solid`
(imported_solids); `survey_stones`, `SurveyedStream` (stones).
"""
