"""Formulations that report a mean pressure in place of a pressure that varies, or that deny that they lock."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from mutate import Mutant

from contactverif_mortar import chen_hisada, sts
from contactverif_mortar.chen_hisada_method import ChenHisada

WAVY, CURVED = "accuracy.wavy", "accuracy.wavy-curved"


class MeanReport(ChenHisada):
    """Every point in contact reports the mean pressure: the sum of the slave's forces is accounted for."""

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> Any:
        points = ChenHisada.contact_points(self, interface, pairing, z)
        total = (points.pressure * points.weight)[points.active].sum()
        mean = total / max(points.weight[points.active].sum(), np.finfo(float).tiny)
        return replace(points, pressure=np.where(points.active, mean, 0.0))


def _reports_mean(*, penalty: float) -> Any:
    right = chen_hisada(penalty=penalty)
    return MeanReport(right.traits, right.penalty, right.quadrature, right.tau)


def _denies_that_it_locks(*, penalty: float) -> Any:
    right = sts(penalty=penalty)
    return replace(right, traits=right.traits.revise(locks=False))


MUTANTS = (
    Mutant("mean pressure reported at all points in contact", WAVY, _reports_mean),
    Mutant("locking that is denied", CURVED, _denies_that_it_locks),
)
