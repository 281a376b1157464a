"""Connections and sessions on SQLite and PostgreSQL.

Public: `Database`, `open_database` (session); `SqliteFile` (sqlite); `PostgresqlServer` (postgresql).
"""
