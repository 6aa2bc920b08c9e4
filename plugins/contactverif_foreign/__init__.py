"""Formulations in other languages: a C library, a user element of Abaqus (UEL), or a user element of FEAP.

The name says which file to load: `c:file=PATH`, `uel:file=PATH,nodes=3` or `feap:file=PATH,number=1`.

| file | what is in it |
|---|---|
| `user_element.py` | user elements as formulations: the arguments of `uel` and of `elmtNN`, calls, assembly |
| `c_library.py` | libraries with the functions of `contactverif.h`, and what they are shown |
| `element_pairs.py` | which nodes form an element |
| `shared_library.py` | the file, its functions, its traits from TOML, and the guarded memory of its calls |
"""
