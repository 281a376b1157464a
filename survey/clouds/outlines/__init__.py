"""Readers of outlines of stones: drawn polygons, label images and masks of segmentation programs.

Public: `Outline` (outline); `read_outlines` (reading).
"""
