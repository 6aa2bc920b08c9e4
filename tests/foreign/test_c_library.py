"""Libraries in C: right ones are what our formulation is, with decisions in integers or in a handle."""

import numpy as np
import pytest

from contactverif import Case, Interface, MisuseError, Pairing, load_formulation, named_case
from contactverif.contract.errors import ContractError
from foreign.comparison import CASES, Build, agree, compare, ring_case, subject_of

Exchanges = tuple[tuple[str, str], ...]
REFERENCE, OFFSET = "nts-ar:area=reference", named_case("offset-c")
# Texts of the library that are exchanged: it decides in `cv_element`, or does something wrong.
ITSELF = (
    ("int cv_pair(", "static int never_called("),
    (
        "    (void)n_decisions;\n",
        "    int own[2 * view->n_slave_segments];\n    decide(view, own);\n    decisions = own;\n",
    ),
)
A_TERM_LESS = (("(t_i * r_j + r_i * t_j)", "(r_i * t_j)"),)
A_FORCE_MORE = (("    (void)n_decisions;\n", "    residual[2 * (view->n_slave_nodes + view->n_master_nodes)] = 0;\n"),)
A_DECISION_MORE = (("        decide(view, decisions);\n", "        decisions[capacity] = 0;\n"),)
GIVES_UP = (("    (void)n_decisions;\n", "    return 7;\n"),)
REFUSES = (("    return count;\n", "    return -1;\n"),)
TRAITS = (("int cv_version", "const char *cv_traits(void) { return \"area = 'current'\"; }\nint cv_version"),)


@pytest.mark.parametrize("exchanges", [(), ITSELF], ids=["cv_pair", "itself"])
@pytest.mark.parametrize("elements", ["segment", "interface"])
@pytest.mark.parametrize("name", CASES)
def test_springs_in_c_are_those_of_ours(name: str, elements: str, exchanges: Exchanges, build: Build) -> None:
    library = build("springs.c", *exchanges)
    compare(f"c:file={library},elements={elements}", REFERENCE, named_case(name))


def test_a_closed_master_has_no_free_end_in_c(build: Build) -> None:
    compare(f"c:file={build('springs.c')}", REFERENCE, ring_case())


def test_decisions_are_a_pairing_of_integers(build: Build) -> None:
    pairing = subject_of(f"c:file={build('springs.c')}").for_case(OFFSET).pair(OFFSET.interface, OFFSET.z)
    assert isinstance(pairing, Pairing)
    assert len(pairing["decision"]) == 2 * len(OFFSET.interface.slave)
    itself = subject_of(f"c:file={build('springs.c', *ITSELF)}").for_case(OFFSET)
    assert itself.pair(OFFSET.interface, OFFSET.z) is None


def test_the_residual_is_smooth_on_frozen_decisions(build: Build) -> None:
    """The tangent on a pairing is the derivative of the residual on it, also where a node leaves the master."""
    checked = subject_of(f"c:file={build('springs.c')}").for_case(OFFSET)
    pairing = checked.pair(OFFSET.interface, OFFSET.z)
    direction = np.random.default_rng(1).normal(size=OFFSET.z.size)
    step = np.finfo(float).eps ** (1 / 3) * np.abs(OFFSET.z).max()
    ends = [checked.residual(OFFSET.interface, pairing, OFFSET.z + sign * step * direction) for sign in (1, -1)]
    slope = (ends[0] - ends[1]) / (2 * step)
    exact = checked.tangent(OFFSET.interface, pairing, OFFSET.z) @ direction
    assert np.abs(slope - exact).max() <= np.finfo(float).eps ** 0.5 * np.abs(exact).max()


def test_the_order_of_the_tangent_is_that_of_the_option(build: Build) -> None:
    library = build("springs.c", *A_TERM_LESS)
    by_row, by_column = (
        subject_of(f"c:file={library},order={order}")
        .for_case(OFFSET)
        .tangent(OFFSET.interface, None, OFFSET.z)
        .toarray()
        for order in ("row", "column")
    )
    assert (by_row == by_column.T).all()
    assert np.abs(by_row - by_column).max() > 0


def test_a_library_without_a_tangent_gets_none(build: Build) -> None:
    subject = subject_of(f"c:file={build('springs.c')},tangent=false")
    assert "tangent" not in subject.provides
    agree(
        *(each.for_case(OFFSET).residual(OFFSET.interface, None, OFFSET.z) for each in (subject, subject_of(REFERENCE)))
    )


def test_many_decisions_get_room(build: Build) -> None:
    """One element with all segments has more decisions than the first call has room for."""
    x = np.arange(21.0)
    interface = Interface.from_chains(np.column_stack([x, 0 * x - 0.1]), np.column_stack([x[::-1], 0 * x]))
    case = Case(interface=interface, z=interface.nodes.ravel(), penalty=2.0)
    text = f"c:file={build('springs.c')},elements=interface"
    pairing = subject_of(text).for_case(case).pair(interface, case.z)
    assert pairing is not None
    assert len(pairing["decision"]) == 40
    compare(text, REFERENCE, case)


def test_what_a_library_says_of_itself_counts_more_than_the_file_beside_it(build: Build) -> None:
    beside = subject_of(f"c:file={build('springs.c')}").traits
    assert beside.promises.patch.flat is False
    assert beside.rules.area == "reference"
    itself = subject_of(f"c:file={build('springs.c', *TRAITS)}").traits
    assert (itself.rules.area, itself.promises.patch.flat) == ("current", None)


@pytest.mark.parametrize(
    ("exchanges", "message"),
    [
        (A_FORCE_MORE, "cv_element: slave segment 0: wrote to number 13 of residual, which has 12"),
        (A_DECISION_MORE, "cv_pair: slave segment 0: wrote to number 17 of decisions, which has 16"),
        (GIVES_UP, "cv_element: slave segment 0: returned 7; needed 0"),
        (REFUSES, "cv_pair: slave segment 0: returned -1; needed ≥ 0"),
    ],
)
def test_what_a_library_does_wrong_is_named(exchanges: Exchanges, message: str, build: Build) -> None:
    checked = subject_of(f"c:file={build('springs.c', *exchanges)}").for_case(OFFSET)
    with pytest.raises(ContractError) as error:
        checked.residual(OFFSET.interface, None, OFFSET.z)
    assert message in str(error.value)


def test_a_library_of_another_version_is_refused(build: Build) -> None:
    with pytest.raises(MisuseError, match=r"of version 9; needed 1, that of contactverif\.h"):
        load_formulation(f"c:file={build('springs.c', ('return CV_VERSION', 'return 9'))}")


@pytest.mark.parametrize(
    ("options", "parts"),
    [
        ("elements=node", ["option elements", "'node'", "one of segment, interface"]),
        ("order=fortran", ["option order", "one of row, column"]),
        ("tangent=no", ["option tangent", "true or false"]),
    ],
)
def test_a_wrong_option_of_c_is_one_line(options: str, parts: list[str], build: Build) -> None:
    with pytest.raises(MisuseError) as error:
        load_formulation(f"c:file={build('springs.c')},{options}")
    for part in parts:
        assert part in str(error.value)
    with pytest.raises(MisuseError, match="without the function cv_version"):
        load_formulation(f"c:file={build('nts_uel.f90')}")
