"""Relations, courses and arches computed from solids; load paths.

Public: `relations_between`, `RelationSettings` (classify); `arches_among` (arch_rings); `find_arches` (arches);
`store_relations` (store); `neighbours`, `carries`, `carried_by`, `courses_in_order`, `stones_near` (graph);
`load_path`, `LoadPath` (load_paths); `members_of_structures` (members).
"""
