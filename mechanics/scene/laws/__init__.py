"""Contact laws: each states its contacts as a shift and a friction cone.

Public: `Law`, `Joint`, `Approach`, `Terms`, `Springs` (law); `DryJoint` (dry_joint); `MortarJoint` (mortar);
`CohesiveZone` (cohesive_zone); `ElasticJoint` (elastic_joint); `LennardJones` (lennard_jones);
`contact_status` (status).
"""
