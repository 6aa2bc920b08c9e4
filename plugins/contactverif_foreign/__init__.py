"""Formulations in other languages: a C library, a user element of Abaqus (UEL), or a user element of FEAP.

The name says which file to load: `c:file=PATH`, `uel:file=PATH,nodes=3` or `feap:file=PATH,number=1`.

| file | what is in it |
|---|---|
| `user_element.py` | a user element as a formulation: pairing in a handle, one call an element, assembly |
| `uel_element.py`, `feap_element.py` | the arguments of `uel` and of `elmtNN`, and their factories |
| `c_library.py`, `c_view.py` | the factory of a library with the functions of `contactverif.h`, and what it is shown |
| `element_pairs.py` | which nodes form an element |
| `guarded_slot.py` | the memory that a library gets, with guard values around each array |
| `shared_library.py` | the file, its functions, and the numbers of the option `props` |
| `traits_file.py` | traits from TOML |
"""
