"""Database schema: declared tables of entities, structures, relations, knowledge, surveys and runs.

Public: `Entity`, `kind_named`, `kinds`, `own_attributes` (entities); `Structure`, `structure_kinds` (structures);
`Membership`, `Relation` (relations); `Correction`, `Material`, `Phase`, `Statement` (knowledge); `Measurement`,
`Simplification`, `Survey` (surveys); `CellResult`, `ContactPoint`, `EntityResult`, `JointResult`, `MechanismStone`,
`Run`, `StructureResult` (runs);
`Entry`, `held_at`, `new_entry` (entries); `StoneAttribute`, `attribute` (base); `definition_of`, `kind_of`,
`kinds_below` (hierarchy); `Stratigraphy` (stratigraphy); `RegisteredKind` (registered);
`SCHEMA_VERSION`, `metadata` (layout).
"""
