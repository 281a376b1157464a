"""Profiles: settings chosen by measured error."""
