"""A scene in other units, other numbers, turned or mirrored, and an interface in another place: the same problem.

Rule for the next editor: only powers of two change units, and only a way that adds no digit to any coordinate moves an
interface, so that nothing but the exponents, or the place, changes.
"""

from dataclasses import replace
from functools import lru_cache
from math import frexp
from typing import Any

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import SPACE, Interface
from contactverif.mechanics.bulk import SCENES_SIZE
from contactverif.mechanics.scene import Scene


@lru_cache(maxsize=SCENES_SIZE)
def change_units(scene: Scene, length: float, modulus: float) -> Scene:
    """Return the scene with all lengths and all moduli multiplied.

    A nodal force is multiplied by length × modulus, in space by length² × modulus, a pressure by the modulus, and the
    distributed stiffness ε̂ by modulus / length. The facts of the scene are left out.

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
            load=body.load * (length ** (scene.dim - 1) * modulus),
            start=body.start * length,
        )
        for body in scene.bodies
    )
    changed = Scene(bodies, scene.slave, scene.master, scene.penalty * modulus / length, {}, scene.name)
    # What follows from the bodies is multiplied too, where `cached_property` keeps it, and not computed again.
    stiffer = modulus * length ** (scene.dim - 2)
    factors = {"transformation": 1.0, "stiffness": stiffer, "load": stiffer * length}
    for name, factor in (factors | dict.fromkeys(("imposed_displacements", "start"), length)).items():
        vars(changed)[name] = factor * getattr(scene, name)
    return changed


@lru_cache(maxsize=SCENES_SIZE)
def snap(scene: Scene, spacing: float) -> Scene:
    """Return the scene with coordinates rounded to multiples of `spacing`, a power of two far shorter than a cell."""
    bodies = tuple(replace(body, nodes=np.rint(body.nodes / spacing) * spacing) for body in scene.bodies)
    return replace(scene, bodies=bodies)


def move(interface: Interface, way: float) -> Interface:
    """Return an interface moved by `way`, a length, along all axes; its nodes keep all their digits."""
    moved = interface.at(interface.nodes + way)
    if (moved.nodes - way != interface.nodes).any():
        raise MisuseError("move", f"{way}, which rounds a node", "a way that rounds no node")
    return moved


def turn(scene: Scene, rotation: FloatArray) -> Scene:
    """Return the scene turned about the origin by a rotation (dim, dim); its facts are left out."""
    bodies = tuple(
        replace(body, nodes=body.nodes @ rotation.T, axis=(rotation @ body.axis.T).T) for body in scene.bodies
    )
    return replace(scene, bodies=bodies, facts={})


def mirror(scene: Scene) -> Scene:
    """Return the mirror image from x to −x; cells, edges and faces run the other way. Its facts are left out.

    The first axis of each body becomes the opposite of its image, so that the others are their images.
    """
    image = np.array([-1.0, 1.0, 1.0])[: scene.dim]  # It takes places, and components along the new axes.
    signs = np.array([[-1.0], [1.0]]) if scene.dim == SPACE else -1.0
    bodies = tuple(
        replace(
            body,
            nodes=body.nodes * image + 0.0,
            cells=body.cells[:, _MIRRORED.get((scene.dim, body.cells.shape[1]), slice(None, None, -1))],
            contact=body.contact[:, ::-1],
            imposed=body.imposed * image + 0.0,
            load=body.load * image + 0.0,
            start=body.start * image + 0.0,
            axis=signs * image * body.axis + 0.0,
        )
        for body in scene.bodies
    )
    return replace(scene, bodies=bodies, facts={})


# {(dim, number of corners of a cell): the corners of its mirror image}; those of others run the other way.
_MIRRORED = {(SPACE, 4): [2, 1, 0, 3], (SPACE, 8): [3, 2, 1, 0, 7, 6, 5, 4]}


def renumber(scene: Scene, random: np.random.Generator) -> tuple[Scene, tuple[IntArray, ...]]:
    """Return the scene with nodes, cells and edges in a random order, and the new number of each node of each body."""
    bodies, numbers = [], []
    for body in scene.bodies:
        new = random.permutation(len(body.nodes))
        old = np.argsort(new)
        arrays: dict[str, Any] = {name: getattr(body, name)[old] for name in ("nodes", "fixed", "imposed", "load")}
        arrays |= {name: random.permutation(new[getattr(body, name)]) for name in ("cells", "contact")}
        if scene.dim == SPACE:  # A face may begin at any of its corners.
            arrays["contact"] = np.array([np.roll(face, random.integers(len(face))) for face in arrays["contact"]])
        bodies.append(replace(body, **arrays))
        numbers.append(new)
    return replace(scene, bodies=tuple(bodies), facts={}), tuple(numbers)


def exchange_roles(scene: Scene) -> Scene:
    """Return the scene whose slaves are the masters, and the other way round; its facts are left out."""
    return replace(scene, slave=scene.master, master=scene.slave, facts={})
