"""Readers and writers of oriented photographs, one module per program.

Public: `read_photomodeler`, `write_photomodeler` (photomodeler); `read_control`, `write_control` (control).
"""
