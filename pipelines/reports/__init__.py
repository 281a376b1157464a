"""HTML reports, filled from the templates in `templates`.

Public: `write_report` (run); `write_assessment` (assessment); `write_page`, `picture` (html).
"""
