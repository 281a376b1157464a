"""Core between the two facings of a wall.

Public: `propose_infill`, `InfillProposal` (propose); `InfillSettings`, `InfillShape` (settings); `find_walls`,
`wall_between`, `facing_stone`, `FacingWall` (facings); `core_blocks` (blocks); `core_storeys` (storeys).
"""
