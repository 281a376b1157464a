"""Energy balance and equilibrium of a scene in motion.

Public: `EnergyBalance`, `kinetic_energy`, `elastic_energy` (energy); `imbalance`, `support_reaction`, `displacement`,
`speed` (equilibrium).
"""
