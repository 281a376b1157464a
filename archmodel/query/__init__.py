"""The query language and its API."""
