"""Time stepping: predict, detect, state the contact problem, solve, advance.

Public: `Simulation` (simulation); `Step`, `ContactForces` (step); `static_start` (static_start);
`Outcome`, `StaticStart` (outcome); `EnergyBalance`, `EnergyTerms` (energy_balance); `Progress`, `Listener`,
`Clock`, `SteppedRun` (progress); `Memory` (warm_start); `Handover`, `Beginning` (handover);
`contact_problem`, `JointCompliance` (contact_problem); `Detection`, `contacts_as_drawn`, `detector` (contact_search).
"""
