"""contactverif tells whether a contact formulation is right.

The names a plugin author needs, and nothing that takes long to import.
"""

from contactverif.case import Case
from contactverif.errors import ContactverifError, ContractError, MisuseError
from contactverif.formulation import ContactPoints, Formulation, Pairing, ResidualOnly, Traits
from contactverif.interface import Interface, Surface

__all__ = [
    "Case",
    "ContactPoints",
    "ContactverifError",
    "ContractError",
    "Formulation",
    "Interface",
    "MisuseError",
    "Pairing",
    "ResidualOnly",
    "Surface",
    "Traits",
]
__version__ = "0.1.0"
