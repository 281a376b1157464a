"""A database over HTTP, to be read only: viewer, queries, entities, runs, schema and downloads.

Public: `ServeSettings` (settings); `serve_database` (serve).
"""
