"""Compiled loops of simplification."""
