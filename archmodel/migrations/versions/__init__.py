"""Alembic scripts, one for each version of the layout.

A script has `upgrade` and `downgrade` and, where the older layout holds less, `losses`: a function of the connection
that describes what the way down drops.
"""
