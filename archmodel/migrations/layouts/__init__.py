"""Layouts of earlier versions, as they were: they never change with the program.

Public: `metadata` (version1).
"""
