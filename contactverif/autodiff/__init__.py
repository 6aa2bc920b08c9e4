"""A formulation made from one pure function of JAX: an energy or a force, of one contact element.

An element is a row of the pairing: some nodes, and what was decided about them. The same function is evaluated for all
elements at once, padded to a power of two, so that a mesh of another size rarely compiles anew. Forces and tangents of
the elements are added in numpy, so neither shapes nor bits depend on how many nodes the rest of the interface has.

Rule for the next editor: nothing here imports JAX before a user calls for it, and JAX is set up in one place.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from contactverif.contract.arrays import FloatArray
from contactverif.contract.errors import ContractError, MisuseError
from contactverif.contract.formulation import Pairing
from contactverif.contract.interface import Interface
from contactverif.contract.traits import Abilities, Traits

Element = Callable[..., Any]  # A function (x, reference, decisions, penalty) of one element.
Pair = Callable[[Interface, FloatArray], Mapping[str, NDArray[Any]]]

_SMALLEST_BUCKET = 16  # Elements. Most random meshes have fewer.
_ONE_THREAD = "--xla_cpu_multi_thread_eigen=false"  # XLA computes an operation in one thread.
_NEEDED_ABILITIES = "an ability that JAX has: neither batched, nor takes_complex, nor takes_longdouble"


def from_energy(energy: Element, *, pair: Pair, traits: Traits | None = None) -> Callable[..., JaxFormulation]:
    """Make a formulation from the energy of one contact element: the factory that an entry point names.

    The residual is the gradient of the energy, and the tangent its second derivative. JAX computes both in double
    precision, on one thread.

    Parameters
    ----------
    energy : Callable
        A pure function ``energy(x, reference, decisions, penalty)`` of JAX, which returns a number. ``x`` and
        ``reference`` are the current and the reference positions (n_nodes_of_element, dim) of the nodes of one element.
        ``decisions`` holds, by name, the row of this element of each other array of the pairing. ``penalty`` is a
        number.
    pair : Callable
        The function ``pair(interface, z)`` that decides which nodes touch. It returns a mapping of numpy arrays with
        a row for each element: ``"nodes"``, int64 (n_elements, n_nodes_of_element), and any others of int64 or bool. A
        node may occur twice in a row, where an element has fewer nodes than others.
    traits : Traits | None
        The promises of the formulation; None promises nothing.

    Raises
    ------
    MisuseError
        If JAX is not installed, or the traits state that the formulation takes batches or other kinds of numbers.

    See Also
    --------
    from_residual : The same with the forces of an element, for a formulation that has no energy.
    """
    jax = _set_up_jax()
    return _factory(jax, jax.grad(energy), pair, traits)


def from_residual(residual: Element, *, pair: Pair, traits: Traits | None = None) -> Callable[..., JaxFormulation]:
    """Make a formulation from the forces of one contact element: the factory that an entry point names.

    The tangent is the Jacobian of the forces. JAX computes both in double precision, on one thread.

    Parameters
    ----------
    residual : Callable
        A pure function ``residual(x, reference, decisions, penalty)`` of JAX. It returns the forces on the nodes of one
        element, internal minus external, in the shape (n_nodes_of_element, dim) of ``x``. The arguments are those that
        `from_energy` describes.
    pair, traits : Callable, Traits | None
        As for `from_energy`.

    See Also
    --------
    from_energy : The same with an energy, whose gradient the forces are.
    """
    return _factory(_set_up_jax(), residual, pair, traits)


def _set_up_jax() -> Any:
    if _ONE_THREAD not in os.environ.get("XLA_FLAGS", ""):  # JAX reads it when it computes for the first time.
        os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} {_ONE_THREAD}".strip()
    os.environ.setdefault("NPROC", "1")  # The size of its pool of threads.
    os.environ.setdefault("JAX_PLATFORMS", "cpu")
    try:
        import jax
    except ImportError as error:
        raise MisuseError("jax", f"no JAX ({error})", "pip install 'contactverif[jax]'") from None
    jax.config.update("jax_enable_x64", True)
    return jax


def _factory(jax: Any, forces: Element, pair: Pair, traits: Traits | None) -> Callable[..., JaxFormulation]:
    traits = traits or Traits()
    if traits.abilities != Abilities(dimensions=traits.abilities.dimensions):
        raise MisuseError("traits", f"{traits.abilities}", _NEEDED_ABILITIES)
    over_elements = (0, 0, 0, None)
    compiled_forces, stiffness = (jax.jit(jax.vmap(f, over_elements)) for f in (forces, jax.jacfwd(forces)))

    def make(*, penalty: float) -> JaxFormulation:
        return JaxFormulation(compiled_forces, stiffness, pair, traits, penalty)

    return make


class JaxFormulation:
    """A formulation whose residual and tangent are sums over contact elements."""

    def __init__(self, forces: Element, stiffness: Element, pair: Pair, traits: Traits, penalty: float) -> None:
        self._forces, self._stiffness, self._pair = forces, stiffness, pair
        self.traits, self._penalty = traits, float(penalty)

    def pair(self, interface: Interface, z: FloatArray) -> Mapping[str, NDArray[Any]]:
        """Return the elements at a state z (n_unknowns,)."""
        pairing = self._pair(interface, z)
        nodes = pairing["nodes"] if "nodes" in pairing else np.empty(0)
        if nodes.ndim != 2 or nodes.dtype != np.int64:
            raise ContractError(f"pair: 'nodes' of shape {nodes.shape}, {nodes.dtype}; needed int64 (n_elements, n)")
        for name, rows in pairing.items():
            if rows.ndim == 0 or len(rows) != len(nodes):
                raise ContractError(
                    f"pair: {name!r} of shape {rows.shape}; needed a row for each of {len(nodes)} elements"
                )
        return pairing

    def residual(self, interface: Interface, pairing: Pairing, z: FloatArray) -> FloatArray:
        """Return the nodal forces (n_unknowns,) at a state z (n_unknowns,)."""
        nodes, total = pairing["nodes"], np.zeros((interface.n_nodes, interface.dim))
        forces = self._evaluate(self._forces, interface, pairing, z)
        np.add.at(total, nodes, forces.reshape(*nodes.shape, interface.dim))
        return total.reshape(-1)

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray) -> Any:
        """Return the tangent (n_unknowns, n_unknowns) at a state z (n_unknowns,), sparse."""
        n_elements, n_nodes = pairing["nodes"].shape
        n = n_nodes * interface.dim
        unknowns = (interface.dim * pairing["nodes"][..., None] + np.arange(interface.dim)).reshape(n_elements, n)
        places = np.repeat(unknowns, n, axis=1).reshape(-1), np.tile(unknowns, n).reshape(-1)
        entries = self._evaluate(self._stiffness, interface, pairing, z)
        return sparse.coo_array((entries.reshape(-1), places), shape=(z.size, z.size)).tocsr()

    def _evaluate(self, function: Element, interface: Interface, pairing: Pairing, z: FloatArray) -> FloatArray:
        n_elements = len(pairing["nodes"])
        if n_elements == 0:
            return np.empty(0)
        n_computed = max(_SMALLEST_BUCKET, 1 << (n_elements - 1).bit_length())  # A power of two, and not too small.
        rows = np.arange(n_computed) % n_elements  # What pads is a copy of elements that are there.
        decisions = {name: values[rows] for name, values in pairing.items()}
        nodes = decisions.pop("nodes")
        x, reference = z.reshape(-1, interface.dim)[nodes], interface.nodes[nodes]
        return np.asarray(function(x, reference, decisions, self._penalty))[:n_elements]
