"""Measures of a state: energies, imbalance, displacement, speed.

Public: `kinetic_energy`, `elastic_energy` (energy); `imbalance`, `support_reaction`, `displacement`,
`speed` (equilibrium).
"""
