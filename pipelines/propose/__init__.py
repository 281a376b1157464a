"""Proposals for unseen stones (`moma propose`)."""
