"""Text that commands print for people.

Public: `as_table`, `as_lines`, `as_csv`, `as_json`, `as_geojson` (formats); `Question`, `answer` (query);
`entity_lines`, `history_lines` (entities); `record_lines` (knowledge); `check_lines` (checks); `ingest_lines`,
`run_lines`, `survey_report_lines` (runs_and_surveys); `schema_lines` (schema); `trade_lines` (tradeoff).
"""
