"""Descriptions of one entity or run: everything known, its history, its traces."""
