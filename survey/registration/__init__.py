"""Transformation from survey frames and photographs to the site frame."""
