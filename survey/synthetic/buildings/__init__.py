"""Synthetic walls, vaults and assemblies.

Public: `wall` (walls); `corner` (quoins); `two_facings` (facings); `barrel_vault`, `semicircular_arch` (vaults);
`hexagonal_dome`, `angled_pier` (assemblies); `Arch` (openings).
"""
