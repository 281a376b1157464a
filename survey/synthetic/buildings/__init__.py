"""Synthetic walls, vaults and assemblies.

Public: `wall` (walls); `corner` (quoins); `two_facings` (facings); `barrel_vault`, `semicircular_arch` (vaults);
`RibVault`, `RibVaultShape`, `rib_vault` (ribs); `hexagonal_dome`, `angled_pier` (assemblies); `Arch` (openings).
"""
