"""A scene in other units, and a scene in another place: the same problem, so that its solution is known.

Rules for the next editor: only powers of two change units, and only a way that adds no digit to any coordinate moves a
scene, so that nothing but the exponents, or the place, changes. What depends on no place (stiffness, load, start)
stays the same to the last bit.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from math import frexp

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.errors import MisuseError
from contactverif.mechanics.bulk import CACHE_SIZE
from contactverif.mechanics.scene import Scene

# What a scene has in any place, to the last bit. It is not made anew.
PLACELESS = ("unknowns", "slices", "stiffness", "load", "transformation", "imposed_displacements", "start")


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
    return Scene(bodies, scene.slave, scene.master, scene.penalty * modulus / length, {}, scene.name)


@lru_cache(maxsize=CACHE_SIZE)
def snap(scene: Scene, spacing: float) -> Scene:
    """Return the scene with each coordinate of each node rounded to a multiple of `spacing`, a power of two.

    The spacing is a length far shorter than a cell, or cells become flat.
    """
    bodies = tuple(replace(body, nodes=np.rint(body.nodes / spacing) * spacing) for body in scene.bodies)
    return replace(scene, bodies=bodies)


@lru_cache(maxsize=CACHE_SIZE)
def move(scene: Scene, x: float, y: float) -> Scene:
    """Return the scene moved by (x, y), to the last bit.

    Parameters
    ----------
    scene : Scene
        The scene.
    x, y : float
        The way, a length each.
    """
    bodies = []
    for body in scene.bodies:
        nodes: FloatArray = body.nodes + (x, y)
        if (nodes - (x, y) != body.nodes).any():
            raise MisuseError("move", f"({x}, {y}), which rounds a node of {body.name}", "a way that rounds no node")
        bodies.append(replace(body, nodes=nodes))
    moved = replace(scene, bodies=tuple(bodies))
    if moved.bodies_in_reach == scene.bodies_in_reach:
        for name in PLACELESS:
            moved.__dict__[name] = getattr(scene, name)  # Where `cached_property` keeps it.
    return moved
