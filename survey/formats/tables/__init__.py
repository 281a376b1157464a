"""Tables of points and lists of total stations, from text and workbooks.

Public: `open_csv`, `open_pnezd`, `open_penzd` (reader); `find_columns`, `read_map`
(columns); `CodeTemplate` (code_template); `read_kinds` (kinds).
"""
