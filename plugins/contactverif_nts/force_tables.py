"""The forces that NTS, NTS-AR and VTS-ME make of a uniform pressure p = 1 on named flat cases, in rationals.

They are what Eq. 6 gives by hand. A slave node has the force of its springs: 1 with nodal springs, the length of its
area of competence with distributed ones. Each force is shared between the nodes of the master segment below by the
lever rule. The paper prints those of NTS-AR and VTS-ME on the master for the cases B and C. In a case whose name ends
in "-swapped" slave and master have exchanged their lengths.

Rule for the next editor: nobody computes these tables by a kernel, since they are what the kernels are held to.

Source: Zavarise & De Lorenzis (2009), Figs. 8, 16 and 20, and Eq. 6.
"""

from types import MappingProxyType

NTS = MappingProxyType(
    {
        "a1": "1 1 1; 3/2 3/2",
        "a2": "1 1 1 1 1; 25/8 15/8",
        "b": "1 1 1 1 1; 4/3 4/3 5/6 1/2 1",
        "c": "1 1 1 1 1; 4/3 4/3 2/3 2/3 1",
        "c-prime": "1 1 1 1 1; 4/3 4/3 17/24 5/8 1",
        "a1-swapped": "1 1; 1 0 1",
        "a2-swapped": "1 1; 1 0 0 0 1",
        "b-swapped": "1 1 1 1 1; 1 1/2 1 1 3/2",
        "c-swapped": "1 1 1 1 1; 1 1/2 1 5/4 5/4",
        "c-prime-swapped": "1 1 1 1 1; 1 1/2 1 6/5 13/10",
    }
)
NTS_AR = MappingProxyType(
    {
        "a1": "1 2 1; 2 2",
        "a2": "1/2 1 3/2 3 2; 4 4",
        "b": "1 2 3 4 2; 5/3 10/3 3 2 2",
        "c": "1 2 3 4 2; 5/3 10/3 7/3 8/3 2",
        "c-prime": "1 2 3 4 2; 5/3 10/3 5/2 5/2 2",
        "a1-swapped": "2 2; 2 0 2",
        "a2-swapped": "4 4; 4 0 0 0 4",
        "b-swapped": "3/2 3 7/2 3 1; 3/2 3/2 13/4 13/4 5/2",
        "c-swapped": "3/2 3 3 3 3/2; 3/2 3/2 3 15/4 9/4",
        "c-prime-swapped": "3/2 3 31/10 3 7/5; 3/2 3/2 61/20 73/20 23/10",
    }
)
VTS_ME = MappingProxyType(
    {
        "a1": "1 2 1; 2 2",
        "a2": "1/2 1 3/2 3 2; 4 4",
        "b": "1 2 3 4 2; 3/2 3 7/2 3 1",
        "c": "1 2 3 4 2; 3/2 3 17/6 10/3 4/3",
        "c-prime": "1 2 3 4 2; 3/2 3 3 45/14 9/7",
        "a1-swapped": "2 2; 1 2 1",
        "a2-swapped": "4 4; 0 0 4 2 2",
        "b-swapped": "3/2 3 7/2 3 1; 15/16 33/16 97/32 127/32 2",
        "c-swapped": "3/2 3 3 3 3/2; 15/16 33/16 3 129/32 63/32",
        "c-prime-swapped": "3/2 3 31/10 3 7/5; 15/16 33/16 2409/800 3207/800 99/50",
    }
)
BY_METHOD = {"nts": NTS, "nts-ar": NTS_AR, "vts-me": VTS_ME}
