"""Joint closing: one plane for every two faces that meet.

Public: `close_joints`, `ClosedStones` (close); `JointSettings`, `JointMode` (settings); `ClosingReport`, `StoneJoint`,
`Gap`, `Overlap` (report); `GrownLeaf`, `Opening` (grown_leaf); `find_facing`, `FacingFaces` (facing); `contact_planes`,
`ContactPlanes` (contact_planes); `find_overlaps` (overlaps).
"""
