"""From survey files to the database (`moma ingest`)."""
