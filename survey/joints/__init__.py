"""Joint closing: one plane for every two faces that meet.

Public: `close_joints`, `ClosedStones` (close); `JointSettings`, `JointMode` (settings); `ClosingReport`, `StoneJoint`,
`Gap`, `GrownLeaf`, `Overlap` (report); `find_facing`, `FacingFaces` (facing); `contact_planes`, `ContactPlanes`
(contact_planes); `find_overlaps` (overlaps).
"""
