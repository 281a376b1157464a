"""Declarative models: the database schema."""
