"""Linear elasticity of one stone: operators, stress, recovery at the nodes, error estimate."""

from mechanics.stones.elasticity.operators import ElasticOperators, elastic_operators, node_volumes
from mechanics.stones.elasticity.recovery import recovery
from mechanics.stones.elasticity.stress import sampled_stress, stress_error
from mechanics.stones.elasticity.tensors import from_voigt, principal, to_voigt, von_mises

__all__ = [
    "ElasticOperators",
    "elastic_operators",
    "from_voigt",
    "node_volumes",
    "principal",
    "recovery",
    "sampled_stress",
    "stress_error",
    "to_voigt",
    "von_mises",
]
