"""Measures of a sample of disks: cells that follow the material, stress, fabric, strain and surface.

Public: `Tessellation` (tessellation); `Cell`, `layer_members`, `members`, `shape_of` (cells); `moments`, `Stress`,
`mean_stress`, `DiskDeformation`, `deformation`, `Fabric`, `fabric_of` (tensors); `profile`, `slope`, `sides_of`
(surface); `Blocks`, `blocks_of` (blocks); `ShearLimits`, `shear_limits`, `crest_radius` (limits); `Trishear`,
`trishear_fit` (trishear); `TrishearGain`, `trishear_gain` (trishear_gain); `Thrusts`,
`thrusts_of` (thrusts).
"""
