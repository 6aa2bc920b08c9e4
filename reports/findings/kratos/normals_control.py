"""The same blocks with normals of each iterate: mirror images have the same solution to roundoff."""

from kratos_blocks import press

SETTINGS = {
    "search_parameters": {"search_factor": 1e4},
    "normal_variation": "no_derivatives_computation_with_normal_update",
}

for pushed in (0.1, 0.2, 0.3):
    converged, pressures, _ = press([0, 1, 2], [-1, 0, 1.2, 2, 4], SETTINGS, pushed=pushed)
    _, mirrored, _ = press([0, 1, 2], [-2, 0, 0.8, 2, 3], SETTINGS, pushed=pushed)
    change = max(abs(a - b) for a, b in zip(pressures, mirrored[::-1], strict=True)) / max(pressures)
    print(f"pushed by {pushed}: converged {converged}, pressures of the mirror image differ by {change:.1e}")
