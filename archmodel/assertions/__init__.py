"""Recording of assertions: declare, arrange, state, correct, withdraw.

Public: `declare_material`, `declare_property`, `declare_phase`, `declare_document` (declare);
`declare_structure`, `declare_members`, `declare_relation` (arrange); `say_made_of`, `say_of_phase`, `say_mason_mark`,
`say_observation`, `say_depth`, `say_reference`, `say_note`, `Remark` (statements); `correct` (correct);
`withdraw_statements`, `withdraw_members`, `withdraw_relations` (withdraw); `register_kind` (register_kind);
`declare_units`, `say_stratigraphy`, `subjects_named`, `withdraw_stratigraphy` (stratigraphy).
"""
