"""One stone: material, solid, mesh and elasticity, without contact."""
