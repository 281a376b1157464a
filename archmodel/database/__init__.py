"""Connections and sessions on SQLite and PostgreSQL."""
