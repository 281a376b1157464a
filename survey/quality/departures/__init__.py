"""Departures: of beds from level, of faces from plane and plumb, of depths from what is usual.

Public: `Shape`, `Sample`, `Found`, `fit_shapes` (shapes); `find_bed_movements`, `measure_beds`, `WallBeds`,
`BedMovement` (beds); `find_face_departures`, `WallFace`, `FaceMovement`, `OddStone` (faces); `doubtful_depths`,
`DoubtfulDepth` (depths).
"""
