"""Profiles: named settings with their expected errors.

Public: `PROFILES`, `with_profile` (profiles); `expected_errors`, `profile_report` (expected_errors); `Overlay`,
`overlaid`, `scene_lines` (overlay).
"""
