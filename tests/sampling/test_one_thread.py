"""Cases are made on one thread of linear algebra, so that their last bits are those of any machine and any process."""

import subprocess
from dataclasses import replace

from fresh_process import PYTHON
from hypothesis import strategies as st
from planned_cases import draw_cases
from subjects import load_property
from threadpoolctl import threadpool_info, threadpool_limits

from contactverif import Case, named_case
from contactverif.sampling.draw import Sampling, shrink

# A run that judged something before scipy's own BLAS was there.
LATE = """
from contactverif.sampling.hypothesis_draws import one_thread
with one_thread():
    pass
import scipy.linalg
from threadpoolctl import threadpool_info
with one_thread():
    print({entry["num_threads"] for entry in threadpool_info() if entry["user_api"] == "blas"})
"""


def count_threads() -> int:
    return max(entry["num_threads"] for entry in threadpool_info() if entry["user_api"] == "blas")


def test_cases_are_made_on_one_thread() -> None:
    counts: list[int] = []

    def make(number: int) -> Case:
        counts.append(count_threads())
        return replace(named_case("c"), seed=number)

    question = load_property("balance.force")
    with threadpool_limits(limits=2, user_api="blas"):
        source = Sampling(3, 1).source(replace(question, cases=lambda _: (make(1), make(2))))
        strategy = st.integers(1, 9).map(make)
        draw_cases(strategy, seed="1", examples=5)
        shrink(strategy, seed="1", examples=5, first=0, fails=lambda _: True)
    assert isinstance(source, tuple)
    assert len(counts) > 7
    assert set(counts) == {1}


def test_a_library_that_is_loaded_later_has_one_thread_too() -> None:
    answer = subprocess.run([*PYTHON, "-c", LATE], capture_output=True, text=True, check=True)
    assert answer.stdout == "{1}\n"
