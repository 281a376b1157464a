"""Recording of knowledge from TOML files (`moma record`).

Public: `record`, `RecordReport` (record); `read_record`, `RecordFile` (file); `record_depth` (depth); `ARRAYS` (keys).
"""
