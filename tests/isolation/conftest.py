"""Processes of plugins end with the test that started them."""

from collections.abc import Iterator

import pytest

from contactverif.isolation import host


@pytest.fixture(autouse=True)
def nothing_is_left_behind() -> Iterator[None]:
    yield
    host.end_all()
