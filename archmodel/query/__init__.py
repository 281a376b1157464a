"""The query language and its API.

Public: `find`, `find_rows`, `find_faces`, `attributes`, `row_of`, `rows_of` (api);
`feature_collection`, `flattened` (geojson); `condition` (compile); `parse` (grammar).
"""
