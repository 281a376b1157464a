"""The page: a viewer in one offline file, drawings to scale, paper, and other languages.

Public: `Model`, `Column` (model); `run_model`, `assessment_model` (scenes); `known_stones` (known);
`viewer_html` (inline); `elevation` (elevation); `print_pdf` (paper).
"""
