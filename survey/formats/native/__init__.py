"""The native survey format (`.moma`).

Public: `open_moma`, `read_moma`, `read_head`, `with_header` (reader).
"""
