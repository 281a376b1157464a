"""Exchange of a whole database as one JSON document.

Public: `export_building`, `write_building` (writer); `import_building` (reader); `building_schema` (json_schema).
"""
