"""Forecast of the time and memory of a run."""
