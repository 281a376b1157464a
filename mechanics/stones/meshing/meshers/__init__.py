"""Meshers, one per module, and the order in which they are tried.

Public: `Mesher` (choice); `Meshed`, `mesh_block`, `meshed_block` (mesher).
"""
