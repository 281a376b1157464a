"""Single stones: material, solid, mesh and elasticity, without contact.

Public: `Material`, `Orthotropy` (materials); `MassProperties`, `mass_properties` (polyhedra).
"""
