"""Forces of compiled kernels against the same kernels in long double, which nothing compiles."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from compute_uncompiled import PENALTY, RATIOS, bent_states, far_states
from every_formulation import FORMULATIONS

from contactverif import compiler
from contactverif.plugins.registry import load_formulation

pytestmark = pytest.mark.skipif(
    np.finfo(np.longdouble).nmant <= np.finfo(np.float64).nmant, reason="long double is not longer than double here"
)
# With a penetration of 1e-6 of a length, one rounding of a position relative to its neighbours is 1e-10 of a gap.
LARGEST_ERRORS = dict(zip(RATIOS, (1e-10, 1e-9), strict=True))


@pytest.fixture(scope="module")
def in_long_double(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return the archive of `compute_uncompiled`."""
    file = tmp_path_factory.mktemp("long_double") / "answers.npz"
    script = Path(__file__).with_name("compute_uncompiled.py")
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    run = subprocess.run([sys.executable, script, file], env=environment, capture_output=True, text=True, check=False)
    assert not run.returncode, run.stderr
    with np.load(file) as archive:
        return dict(archive)


def test_compiled_kernels_promise_no_long_double() -> None:
    assert compiler.ARE_KERNELS_COMPILED
    assert not compiler.TAKES_LONGDOUBLE
    assert not load_formulation("mortar").traits.abilities.takes_longdouble


@pytest.mark.parametrize("name", FORMULATIONS)
def test_forces_far_from_the_origin_are_right(name: str, in_long_double: dict[str, Any]) -> None:
    formulation = load_formulation(name).with_penalty(PENALTY)
    for state, interface, z in far_states(formulation):
        residual = formulation.residual(interface, formulation.pair(interface, z), z)
        exact = in_long_double[f"{name} {state}"]
        assert exact.dtype == np.longdouble
        forces = slice(0, interface.n_unknowns)
        size = np.abs(exact[forces]).max()
        assert size > 0
        limit = LARGEST_ERRORS[float(state.split()[0])]
        assert np.abs(residual - exact)[forces].max() <= limit * size, state


@pytest.mark.parametrize("name", FORMULATIONS)
def test_nothing_in_a_long_double_residual_is_rounded_to_double(name: str, in_long_double: dict[str, Any]) -> None:
    """A step of 2⁻⁴⁰ leaves 24 of 64 bits to a difference, but only 13 if anything is rounded to double (3e-5)."""
    formulation = load_formulation(name).with_penalty(PENALTY)
    for state, interface, z, direction in bent_states(formulation):
        tangent = formulation.tangent(interface, formulation.pair(interface, z), z)
        if name == "vts-ppt-basic":  # its tangent is approximate
            continue
        error = np.abs(in_long_double[f"{name} {state}"] - tangent @ direction).max()
        assert error <= 4e-6 * abs(tangent).max(), state
