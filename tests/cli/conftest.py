"""The fixture by which tests run `contactverif` in their own process."""

import pytest
from asking import Ask, asking


@pytest.fixture
def ask(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Ask:
    return asking(monkeypatch, capsys)
