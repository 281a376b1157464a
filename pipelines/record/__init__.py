"""Recording of knowledge from TOML files, tables, layers and drawings of the matrix; in `export`, files for others.

Public: `record`, `RecordReport` (record); `FileRecorded` (lists); `read_record`, `RecordFile` (file); `record_depth`
(depth); `ARRAYS` (keys).
"""
