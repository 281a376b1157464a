"""Checks of local mechanisms by building codes, whose rules are data: one file a code.

Public: `CODES`, `Check`, `CodeCheck`, `check_code`, `floor_spectrum` (check).
"""
