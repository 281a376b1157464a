"""Readers of survey files, with line-numbered errors.

Public: `open_survey`, `read_survey`, `FORMATS` (reading); `ReadingOptions` (options).
"""
