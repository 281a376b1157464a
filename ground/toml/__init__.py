"""Validated TOML with line numbers in errors.

Public: `Key`, `ValueKind`, `TomlDocument`, `check_table`, `tables_of`, `nearest` (schema); `keys_of`,
`read_table`, `build` (keys); `read_text`, `parse_toml`, `key_lines` (lines); `toml_text`, `is_table_array` (writer).
"""
