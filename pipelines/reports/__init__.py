"""HTML reports, filled from the templates in `templates`.

Public: `write_report` (run); `write_page`, `picture` (html).
"""
