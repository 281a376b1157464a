"""Points and outlines as instruments and other programs exchange them.

Public: `open_gsi` (gsi); `open_landxml`, `open_jobxml` (survey_xml); `open_geojson` (geojson).
"""
