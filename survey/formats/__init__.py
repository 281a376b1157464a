"""Readers of survey files, each with line-numbered errors."""
