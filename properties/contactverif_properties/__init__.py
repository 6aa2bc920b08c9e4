"""What every contact formulation is asked. The judge shares no code with the judged: no plugin, no projection.

`patch`, `balance`, `tangent`, `invariants` and `purity` hold the properties; `roundoff` the tolerances that they share
and `kinks` what decides whether a state is too near a change of partner for a failure to mean anything.
"""
