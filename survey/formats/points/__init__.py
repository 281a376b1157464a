"""Point lists: CSV, PNEZD and PENZD.

Public: `open_csv`, `read_csv` (csv); `open_pnezd`, `open_penzd` (pnezd); `CodeTemplate` (code_template).
"""
