"""The native survey format (`.moma`): reader and writer.

Public: `open_moma`, `read_moma`, `read_head`, `with_header` (reader); `write_head`, `write_moma` (writer).
"""
