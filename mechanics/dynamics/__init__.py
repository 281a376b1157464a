"""Time stepping: predict, detect, state the contact problem, solve, advance.

Public: `Simulation` (simulation); `Step`, `ContactForces` (step); `Clock` (clock); `static_start` (static_start);
`Watch` (stopping); `Outcome`, `StaticStart` (outcome); `Progress`, `Listener` (progress); `Memory` (warm_start);
`contact_problem` (contact_problem); `Detection`, `detector` (contact_search).
"""
