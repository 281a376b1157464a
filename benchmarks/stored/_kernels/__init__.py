"""Compiled loops of stored contact problems."""
