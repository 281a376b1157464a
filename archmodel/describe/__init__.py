"""Descriptions of one entity or run: everything known, its history, the trace to its measurement.

Public: `describe` (entity); `history`, `known_at` (history); `list_runs`, `describe_run`,
`compare_runs` (runs); `schema` (schema_tree); `trace`, `Trace` (trace).
"""
