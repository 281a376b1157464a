"""Synthetic walls, vaults and towers.

Public: `wall` (walls); `corner` (quoins); `two_facings` (facings); `barrel_vault`, `semicircular_arch` (vaults);
`SyntheticRibVault`, `RibVaultShape`, `rib_vault` (ribs); `tower_storey` (tower); `make_window` (window);
`ArchShape` (openings).
"""
