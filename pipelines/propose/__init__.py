"""Proposals for unseen stones (`moma propose`).

Public: `propose_stones`, `propose_core`, `Recording`, `ProposalReport` (propose).
"""
