"""Scenes: blocks, laws, loads, supports and settings that a user states."""
