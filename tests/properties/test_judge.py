"""All judges share no code with the judged, and see wrong forces."""

import subprocess
from functools import partial
from typing import Any

import numpy as np
import pytest
from fresh_process import PYTHON
from handmade import Handmade, case, subject
from subjects import judge_as

from contactverif import Property, Subject, Verdict, load_properties, named_case
from contactverif.contract.traits import PatchPromises, Promises, Rules, Traits
from contactverif_properties.balance import force_balance, moment_balance
from contactverif_properties.patch_flat import FORCE, patch_flat_transmission


def test_the_judge_loads_no_code_of_a_plugin() -> None:
    """Neither when imported, nor when it makes cases and judges."""
    script = (
        "import sys\n"
        "from contactverif.plugins.registry import load_properties\n"
        "from contactverif.run.run import run\n"
        "from contactverif.contract.subject import Subject\n"
        "class Silent:\n"
        "    def residual(self, interface, pairing, z): return 0 * z\n"
        "questions = load_properties()\n"
        "assert len(questions) >= 7\n"
        "run([Subject('silent', lambda *, penalty: Silent())], questions, examples=3, seed=1)\n"
        "print(sorted(name for name in sys.modules if name.startswith(('contactverif_nts', 'contactverif.geometry',\n"
        "    'numba'))))\n"
    )
    process = subprocess.run([*PYTHON, "-c", script], capture_output=True, text=True, check=True)
    assert process.stdout == "[]\n"


class Fixed(Handmade):
    """Forces (5,) along y that do not depend on the positions."""

    def __init__(self, *forces: float, **traits: Any) -> None:
        super().__init__(**traits)
        self.forces = np.column_stack([np.zeros(5), forces]).reshape(-1)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self.forces


EXACT = np.array([-1.0, -2.0, -1.0, 2.0, 2.0])  # The residual of case a1.


def answer(*forces: float) -> Subject:
    return subject(partial(Fixed, *forces))


def test_exact_forces_pass() -> None:
    outcome = judge_as(Verdict.PASS, patch_flat_transmission, named_case("a1"), answer(*EXACT))
    assert outcome.measurement.values == {FORCE.name: 0.0}


@pytest.mark.parametrize("node", range(5))
@pytest.mark.parametrize("error", [1.0, 1e-6, 1e-12])
def test_an_error_on_any_node_of_either_side_is_seen(node: int, error: float) -> None:
    wrong = EXACT * np.where(np.arange(5) == node, 1 + error, 1.0)
    outcome = judge_as(Verdict.FAIL, patch_flat_transmission, named_case("a1"), answer(*wrong))
    assert outcome.measurement.values[FORCE.name] == pytest.approx(error * abs(EXACT[node]) / 4, rel=1e-3)


def test_states_that_penetrate_are_not_for_barriers() -> None:
    """A barrier is not defined there, and would be accused of its NaN. Multipliers are asked nearly everything."""
    traits = Traits(
        promises=Promises(patch=PatchPromises(flat=True), tangent="exact"),
        rules=Rules(gap="closest point", penalty="distributed", area="current"),
    )
    traits = traits.revise(published_forces={"a1": "1 2 1; 2 2"}, force_along="master normal", continuity="C0")
    traits = traits.revise(gap_shapes="standard", pressure_shapes="standard", opens_at_ends=True)
    nodal = "patch.flat.nodal"
    springs_alone = (
        nodal,
        "projection.activity",
        "stability.stiffness",
        "continuity",
        "patch.tilted.nodal",
        "total-stiffness",
        "intersection-free",
    )
    multipliers_alone = (nodal, "intersection-free", "multipliers.rank", "complementarity", "stability.inf-sup")
    for question in load_properties():
        assert isinstance(question, Property)
        reasons = {
            enforcement: question.refusal(traits.revise(enforcement=enforcement))
            for enforcement in ("penalty", "multiplier", "barrier")
        }
        assert "barrier" in reasons["barrier"]
        assert bool(reasons["multiplier"]) is (question.id in springs_alone)
        assert bool(reasons["penalty"]) is (question.id in multipliers_alone)


def test_forces_balance_or_lack_what_they_lack() -> None:
    judge_as(Verdict.PASS, force_balance, case(), answer(1, 0, -1, 0, 0))
    outcome = judge_as(Verdict.FAIL, force_balance, case(), answer(1, 0, -0.96, 0, 0))
    assert outcome.measurement.values["force imbalance"] == pytest.approx(0.04)
    judge_as(Verdict.FAIL, force_balance, case(), answer(0, 0, 0, 0, 1e-100))  # On the master alone


def test_a_couple_balances_in_force_and_not_in_moment() -> None:
    """Its arm is the way along x from the slave node to the master node, 2 − 5/14."""
    outcome = judge_as(Verdict.FAIL, moment_balance, case(), answer(1, 0, -1, 0, 0))
    arm = 2 - (6 / 7 - 1 / 2)
    assert outcome.measurement.values["moment imbalance"] == pytest.approx(arm / case().diameter)


@pytest.mark.parametrize("question", [force_balance, moment_balance], ids=lambda question: question.id)
def test_no_force_balances(question: Any) -> None:
    judge_as(Verdict.PASS, question, case(), subject(Handmade))
