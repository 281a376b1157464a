"""Photographs: orientation with its precision, and points of stones from marks on them.

Public: `Network`, `Camera`, `Photo`, `Control` (network); `Oriented` (oriented).
"""
