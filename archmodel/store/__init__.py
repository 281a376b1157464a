"""Stones and runs: plain records into the database and out of it, and revisions of rows.

Public: `StoneRecord` (stone_record); `load_stones`, `store_survey` (stones); `stone_columns`, `stone_shapes`
(stone_arrays); `store_hypotheses`, `withdraw_hypotheses` (hypotheses); `RunRecord`, `StoneResult` (run_record);
`store_run` (runs); `RowCounts`, `revise`, `supersede`, `withdraw` (revisions); `subjects` (find_by_code);
`insert_rows` (bulk).
"""
