"""Pillar 1: ASCII surveys → planes → faces → extruded blocks → stones that touch."""
