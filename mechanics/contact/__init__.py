"""Contact detection: from the predicted configuration to contact points.

Public: `Detector` (detection); `Contacts`, `gaps`, `material_points` (contacts); `Surfaces`, `surfaces` (surfaces);
`Recess`, `recess_at` (shared_area).
"""
