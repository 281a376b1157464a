"""Delassus operators: rigid bodies in space, rigid with deformable ones, and their forms for factorisation.

Public: `RigidDelassus`, `Schedule`, `schedule` (rigid); `MixedDelassus` (mixed); `rigid_delassus`, `mixed_delassus`,
`local_velocity`, `world_impulse` (assembly); `BodyForm` (body_space); `CondensedForm` (condensed); `MixedForm`,
`mixed_fronts` (mixed_form); `elimination` (elimination); `Cliques`, `fronts` (multifrontal); `CompliantDelassus`,
`CompliantForm` (compliant).
"""
