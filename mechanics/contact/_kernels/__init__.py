"""Compiled loops of contact detection."""
