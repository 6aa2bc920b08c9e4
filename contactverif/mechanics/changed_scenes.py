"""A scene in other units, and an interface in another place: the same problem, so that its solution is known.

Rule for the next editor: only powers of two change units, and only a way that adds no digit to any coordinate moves an
interface, so that nothing but the exponents, or the place, changes.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from math import frexp

import numpy as np

from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import Interface
from contactverif.mechanics.bulk import CACHE_SIZE
from contactverif.mechanics.scene import Scene


@lru_cache(maxsize=CACHE_SIZE)
def change_units(scene: Scene, length: float, modulus: float) -> Scene:
    """Return the scene with all lengths and all moduli multiplied.

    A nodal force is multiplied by length × modulus, a pressure by the modulus, and the distributed stiffness ε̂ by
    modulus / length. The facts of the scene are left out.

    Returns
    -------
    Scene
        The scene in the other units.

    Examples
    --------
    >>> from contactverif import load_scene
    >>> from contactverif.mechanics.changed_scenes import change_units
    >>> scene = load_scene("c")
    >>> there = change_units(scene, 1024.0, 0.25)
    >>> bool((there.stiffness == scene.stiffness / 4).all()), there.penalty / scene.penalty * 4096
    (True, 1.0)
    """
    for name, factor, base in (("length", length, 1), ("modulus", modulus, 2)):
        digits, exponent = frexp(factor)
        if digits != 0.5 or (exponent - 1) % base:
            raise MisuseError(name, f"{factor!r}", f"a power of {2**base}")
    bodies = tuple(
        replace(
            body,
            nodes=body.nodes * length,
            young=body.young * modulus,
            imposed=body.imposed * length,
            load=body.load * (length * modulus),
            start=body.start * length,
        )
        for body in scene.bodies
    )
    changed = Scene(bodies, scene.slave, scene.master, scene.penalty * modulus / length, {}, scene.name)
    # What follows from the bodies is multiplied too, where `cached_property` keeps it, and not computed again.
    factors = {"transformation": 1.0, "stiffness": modulus, "load": modulus * length}
    for name, factor in (factors | dict.fromkeys(("imposed_displacements", "start"), length)).items():
        vars(changed)[name] = factor * getattr(scene, name)
    return changed


@lru_cache(maxsize=CACHE_SIZE)
def snap(scene: Scene, spacing: float) -> Scene:
    """Return the scene with each coordinate of each node rounded to a multiple of `spacing`, a power of two.

    The spacing is a length far shorter than a cell, or cells become flat.
    """
    bodies = tuple(replace(body, nodes=np.rint(body.nodes / spacing) * spacing) for body in scene.bodies)
    return replace(scene, bodies=bodies)


def move(interface: Interface, way: float) -> Interface:
    """Return an interface moved by `way`, a length, along both axes; its nodes keep all their digits."""
    moved = interface.at(interface.nodes + way)
    if (moved.nodes - way != interface.nodes).any():
        raise MisuseError("move", f"{way}, which rounds a node", "a way that rounds no node")
    return moved
