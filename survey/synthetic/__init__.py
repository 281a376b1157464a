"""Synthetic buildings that never stood, measured as a surveyor would, with their truth; the sample is one of them."""
