"""Read the trace of Newton's method, and its advice where it does not converge.

A trace keeps every iterate: the residual, what roundoff alone makes of it, and how much of the pairing changed. In
case C a virtual slave node of VTS-ME sits on a master node, and its force jumps from one master segment to the other.
"""

from contactverif import load_formulation, load_scene, solve

scene = load_scene("c:penalty=1e4")
for name in ("vts-ppt", "vts-me"):
    trace = solve(scene, load_formulation(name).with_penalty(scene.penalty))
    print(name)
    print("  iterate   residual    its roundoff   changes of the pairing")
    for number, residual in enumerate(trace.residuals):
        print(f"  {number:7}   {residual:8.1e}   {trace.floors[number]:12.1e}   {trace.changes[number]:10}")
    print(f"  {trace.end.label}: {trace.end.advice}")
