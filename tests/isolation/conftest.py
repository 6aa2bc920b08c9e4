"""Each test ends the processes that it started, and may look at the messages that they got."""

from collections.abc import Iterator, Sequence

import pytest

from contactverif.isolation import host
from contactverif.isolation.process import PluginProcess, Question


@pytest.fixture(autouse=True)
def _end_processes() -> Iterator[None]:
    yield
    host.end_all()


@pytest.fixture
def messages(monkeypatch: pytest.MonkeyPatch) -> list[list[tuple[str, float | None]]]:
    """Return the messages to processes: of each question its method, and the seconds that the message has."""
    log: list[list[tuple[str, float | None]]] = []
    real = PluginProcess.ask

    def note(self: PluginProcess, frame: bytes, questions: Sequence[Question], seconds: float | None = None) -> None:
        log.append([(question.verb, seconds) for question in questions])
        real(self, frame, questions, seconds)

    monkeypatch.setattr(PluginProcess, "ask", note)
    return log
