"""The judge of exact flat forces passes what is right in any way of writing, and finds lost digits near and far."""

import os
import subprocess
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from expected_verdicts import FAILS
from fresh_process import PYTHON
from gauss_springs import RIGHT, WRONG, by_differences, springs_of
from subjects import load_subject, measure_case

from contactverif import Abilities, Case, PatchPromises, Promises, Rules, Subject, Traits
from contactverif.sampling.draw import draw_cases
from contactverif_properties.exact_forces import forces_of_penetration, node_gaps
from contactverif_properties.stability import (
    FORCES_THERE,
    LARGEST_DENOMINATOR,
    TOTAL_THERE,
    exact_forces,
    refuse_unknown_forces,
    stability_local,
)
from contactverif_properties.states import move_state


@cache
def cases(count: int = 100, kind: str = "uniform penetration") -> tuple[Case, ...]:
    return draw_cases(stability_local.cases(None)[kind], seed="0/local", examples=count).cases


def worst_number(case: Case, subject: Subject) -> float:
    return max(measure_case(stability_local, case, subject).values.values())


def bits(value: float) -> int:
    """Return how many bits a number has from its first to its last digit 1."""
    numerator = abs(Fraction(value).numerator)
    return numerator.bit_length() - (numerator & -numerator).bit_length() + 1 if numerator else 0


def test_the_states_are_exactly_flat_and_have_many_bits_and_their_move_is_exact() -> None:
    for case in cases():
        far = move_state(case, case.parameters["shift"])
        assert np.array_equal(far.positions - case.parameters["shift"], case.positions)
        assert np.array_equal(far.interface.nodes - case.parameters["shift"], case.interface.nodes)
        x, y = (Fraction(entry).limit_denominator(LARGEST_DENOMINATOR) for entry in case.parameters["direction"])
        assert x**2 + y**2 == 1
        heights = [Fraction(b) * x - Fraction(a) * y for a, b in case.positions.tolist()]
        n_slave = case.interface.n_slave_nodes
        assert set(heights[:n_slave]) == {-Fraction(case.parameter("penetration"))}
        assert set(heights[n_slave:]) == {Fraction(0)}
    widest = [max(map(bits, case.z.tolist())) for case in cases()]
    assert min(widest) >= 32
    assert np.mean([width >= 40 for width in widest]) > 0.4


def test_exact_forces_balance_and_are_the_rounded_ones() -> None:
    for case in cases(20):
        exact = exact_forces(case)
        assert sum(exact[::2]) == sum(exact[1::2]) == 0
        rounded = np.array([float(force) for force in exact]).reshape(-1, 2)
        assert np.allclose(rounded, -forces_of_penetration(case), rtol=1e-14, atol=0)


@pytest.mark.parametrize("name", RIGHT)
@pytest.mark.parametrize("takes_longdouble", [False, True])
def test_a_right_formulation_in_another_way_of_writing_passes(name: str, takes_longdouble: bool) -> None:
    """Long double is the answer where the plugin takes it."""
    way, before = RIGHT[name]
    subject = springs_of(way, before, translation_stable=True, takes_longdouble=takes_longdouble)
    assert max(worst_number(case, subject) for case in cases()) <= 8


@pytest.mark.parametrize("name", WRONG)
@pytest.mark.parametrize("takes_longdouble", [False, True])
def test_a_wrong_formulation_is_accused_by_three_orders_of_magnitude(name: str, takes_longdouble: bool) -> None:
    way, before = WRONG[name]
    subject = springs_of(way, before, translation_stable=True, takes_longdouble=takes_longdouble)
    assert max(worst_number(case, subject) for case in cases()) >= 16e3


@pytest.mark.parametrize("kind", ["uniform penetration", "linear penetration"])
@pytest.mark.parametrize(
    "name",
    ["nts-ar", "vts-g", "vts-ppt", "vts-ppt-balanced", "sts", "mortar", "mortar-dual", "mortar-lm", "chen-hisada"],
)
def test_the_built_in_formulations_are_as_exact_as_their_positions(name: str, kind: str) -> None:
    assert max(worst_number(case, load_subject(name)) for case in cases(kind=kind)) <= 4


@pytest.mark.parametrize("name", ["mortar-lm", "mortar-dual-lm", "vts-ppt-lm"])
def test_multipliers_that_are_pressures_are_judged_by_the_distribution(name: str) -> None:
    subject = load_subject(name)
    assert max(worst_number(case, subject) for case in cases()) <= 4

    class Doubled:
        def __init__(self, *, penalty: float) -> None:
            self.inner = subject.with_penalty(penalty)
            self.traits, self.n_multipliers, self.pair = subject.traits, self.inner.n_multipliers, self.inner.pair

        def residual(self, interface: object, pairing: object, z: np.ndarray) -> np.ndarray:
            forces = self.inner.residual(interface, pairing, z)  # type: ignore[arg-type]
            return 2 * forces

    assert max(worst_number(case, Subject("doubled", Doubled)) for case in cases(30)) <= 4


UNCOMPILED = """
from expected_verdicts import FAILS
from subjects import load_property, load_subject

from contactverif.contract.property import Verdict
from contactverif.run.run import run

result = run([load_subject(name) for name in FAILS], [load_property("stability.local")], examples=10, seed=0)
for row in result.rows:
    assert row.verdict is Verdict.PASS and row.promise, (row.formulation, row.verdict, row.reason)
    assert row.closest.number.value <= 4, (row.formulation, row.closest)
print(len(result.rows), "formulations")
"""


@pytest.mark.skipif(
    np.finfo(np.longdouble).nmant <= np.finfo(np.float64).nmant, reason="long double is not longer than double here"
)
def test_every_built_in_formulation_is_judged_where_nothing_is_compiled() -> None:
    here = str(Path(__file__).parents[1])
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": here}
    command = [*PYTHON, "-W", "error", "-c", UNCOMPILED]
    process = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert not process.returncode, process.stderr
    assert process.stdout.split()[0] == str(len(FAILS))


def test_what_is_exact_follows_the_traits() -> None:
    springs = springs_of(by_differences, takes_longdouble=False)
    assert list(stability_local.measure(cases()[0], springs).values) == [TOTAL_THERE.name]
    assert "no exact force" in refuse_unknown_forces(Traits(rules=Rules(penalty="nodal", area="current")))
    assert "no exact force" in refuse_unknown_forces(Traits())
    assert not refuse_unknown_forces(Traits(abilities=Abilities(takes_longdouble=True)))
    assert "no exact force" in refuse_unknown_forces(
        Traits(
            promises=Promises(patch=PatchPromises(flat=True)), rules=Rules(enforcement="multiplier", penalty="nodal")
        )
    )
    assert "barrier" in stability_local.refusal(Traits(rules=Rules(enforcement="barrier")))


def test_a_linear_penetration_is_exactly_linear_and_closed_everywhere() -> None:
    for case in cases(kind="linear penetration"):
        n_slave = case.interface.n_slave_nodes
        points = [(Fraction(x), Fraction(y)) for x, y in case.positions[:n_slave].tolist()]
        (x_0, y_0), (x_1, y_1) = points[0], points[-1]
        assert all((x - x_0) * (y_1 - y_0) == (y - y_0) * (x_1 - x_0) for x, y in points)
        assert (node_gaps(case) < 0).all()
        far = move_state(case, case.parameters["shift"])
        assert np.array_equal(far.positions - case.parameters["shift"], case.positions)


def test_what_is_exact_under_a_linear_penetration_follows_the_traits() -> None:
    (case,) = cases(1, "linear penetration")
    assert set(stability_local.measure(case, load_subject("sts")).values) == {FORCES_THERE.name, TOTAL_THERE.name}
    assert set(stability_local.measure(case, load_subject("vts-ppt")).values) == {TOTAL_THERE.name}
    assert set(stability_local.measure(case, load_subject("mortar-lm")).values) == {FORCES_THERE.name}
