"""From survey files to the database (`moma ingest`), and whole databases to documents and back.

Public: `ingest` (ingest); `relate`, `RelationReport`, `masonry_values` (relate); `reading_options`,
`solid_options` (reading_options); `kind_rules`, `KindRule` (kind_rules); `IngestReport`, `FileReport` (report);
`stone_record`, `surveyed_block` (records); `export_database`, `import_database` (exchange).
"""
