"""Turn all signs of a right formulation round, and see what the harness says first.

The residual is internal minus external force, so minus the residual pushes a slave node along the master's outward
normal. A first plugin often has it the other way round. The harness sees that before it asks any property.
"""

from contactverif import Rules, Subject, Traits, load_formulation, load_properties, verify


class Negated:
    """NTS-AR with all signs turned round."""

    traits = Traits(rules=Rules(penalty="distributed"))

    def __init__(self, *, penalty):
        self.right = load_formulation("nts-ar").with_penalty(penalty)

    def pair(self, interface, z):
        return self.right.pair(interface, z)

    def residual(self, interface, pairing, z):
        return -self.right.residual(interface, pairing, z)


if __name__ == "__main__":
    run = verify([Subject("negated", Negated)], load_properties(["balance.*", "unilateral"]), examples=20, seed=1)
    print("forces of the opposite sign:", *run.opposite_signs)
    for row in run.rows:
        print(f"{row.property_id}: {row.result}", row.reason, sep="\n    " if row.reason else "")
    print("every promise is kept" if run.promises_kept else "the run fails")
