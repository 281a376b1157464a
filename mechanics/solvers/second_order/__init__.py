"""Second-order methods: Newton's method and the interior point.

Public: `Newton` (newton); `InteriorPoint` (interior_point); `SofterJoints` (softer_joints).
"""
