"""Formulations as a person writes them in a session: right forces of VTS-PPT, and half of them."""

from typing import Any

from subjects import load_subject


class Right:
    """The forces of VTS-PPT times a factor, which is 1 unless somebody says otherwise."""

    def __init__(self, *, penalty: float, factor: float = 1.0) -> None:
        self.penalty, self.factor = penalty, factor
        self.inner = load_subject("vts-ppt").with_penalty(penalty)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self.factor * self.inner.residual(interface, None, z)


class Half(Right):
    """Half of the right forces."""

    def __init__(self, *, penalty: float) -> None:
        super().__init__(penalty=penalty, factor=0.5)
