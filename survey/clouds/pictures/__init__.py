"""Outlines of stones proposed from pictures: joints, then regions between them, then masonry.

Public: `Proposal`, `ProposedStone`, `ProposedBorder`, `propose_outlines` (proposal); `Photograph`,
`open_photograph` (photograph); `bond_statistics` (statistics).
"""
