"""Functions of the query language, one module per argument.

Public: `FUNCTIONS`, `STRUCTURE_FUNCTIONS` (registry); `USAGES` (usages).
"""
