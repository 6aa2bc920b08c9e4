"""Drawing random cases beside hypothesis' own lists of integers, and drawing pictures beside an empty figure."""

from io import BytesIO
from typing import Any

import pytest
from hypothesis import strategies as st
from matplotlib.figure import Figure
from racing import Race
from subjects import load_property

from contactverif import named_case
from contactverif.sampling.draw import Sampling, draw_cases
from contactverif_reports.plot.case_figures import make_case_figure
from contactverif_reports.plot.text import as_text

N_DRAWN = 25


@pytest.mark.parametrize("property_id", ["patch.flat.transmission", "tangent.directional", "patch.flat.solve"])
def test_random_cases(race: Race, benchmark: Any, property_id: str) -> None:
    benchmark.group = f"{N_DRAWN} random cases drawn"
    question, sampling = load_property(property_id), Sampling(N_DRAWN, 1)
    source, key = sampling.source(question), sampling.key(question)
    plain: Any = st.lists(st.integers(1, 8), min_size=1, max_size=12)
    race(
        lambda: draw_cases(source, seed=key, examples=N_DRAWN),
        lambda: draw_cases(plain, seed=key, examples=N_DRAWN),
        "hypothesis draws lists of integers",
    )


def as_picture(figure: Figure) -> bytes:
    file = BytesIO()
    figure.savefig(file, format="png")
    return file.getvalue()


def empty_picture() -> bytes:
    figure = Figure(figsize=(6, 4))
    figure.add_subplot()
    return as_picture(figure)


def test_picture_of_a_case(race: Race, benchmark: Any) -> None:
    benchmark.group = "a case as a picture"
    case = named_case("c")
    race(
        lambda: as_picture(make_case_figure(case, title="", forces=None, exact=None)),
        empty_picture,
        "matplotlib draws empty axes",
    )


def test_text_of_a_case(race: Race, benchmark: Any) -> None:
    benchmark.group = "a case as a picture"
    case = named_case("c")
    race(lambda: as_text(case), empty_picture, "matplotlib draws empty axes")
