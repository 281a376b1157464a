"""The page that corrects outlines: picture, outlines and doubts in one offline file.

Public: `PageDoubt`, `editor_html` (page).
"""
