"""Scene files: settings, keys, selection of stones, laws and loads.

Public: `read_scene`, `parse_scene`, `SceneFile`, `TABLES` (file); `select_stones`, `select_groups` (selection);
`law_rules` (laws); `build_loads`, `thrown` (loads); `fingerprint`, `changes` (fingerprint); `rig_cautions`
(rig_cautions); `standing_stones`, `refuse_stages` (stages).
"""
