"""The hidden side of a stone: depth rules and extrusion along the normal.

Public: `depth_for`, `Depth` (depth); `extrude`, `prism`, `SurveyedBlock` (extrusion); `block_of_solid`
(imported_solids).
"""
