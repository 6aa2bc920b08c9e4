"""Reasons why a property has no wrong formulation that it alone catches. `test_trust.py` holds them to the table."""

HARD = "It is a named case of what random cases of other properties reach too, and is kept because it always runs."
SCENE = "Whole solutions show how large an error is. Its cause also shows at single states, which others look at."
BALANCE = "Forces out of balance are no exact forces either, so a patch or projection property catches them too."
DERIVATIVE = (
    "`tangent.sparsity` judges each block of the same derivative, and so sees what a direction or a solution sees."
)
CLASS = "The meshes of its class belong to larger classes, and the interface and the solved scene are asked the same."
TILTED = "`stability.local` asks about forces of tilted states too, in roundings."
POINTS = "Another property computes the forces from the points that the formulation reports."
UNITS = "An absolute size is wrong in an exact answer too, where lengths are small or large enough."
DIGITS = "Lost digits show in several ways of asking: near or far, on named or on random states, solved or not."
SIDES = "A formulation that prefers a side, an axis or a number gives forces that are wrong in an exact answer too."

SHARED = {
    **dict.fromkeys(("accuracy.hertz", "accuracy.wavy", "patch.curved"), SCENE),
    **dict.fromkeys(("patch.flat.solve", "patch.variants", "patch.dead-zone"), SCENE),
    **dict.fromkeys(("balance.force", "balance.moment"), BALANCE),
    **dict.fromkeys(
        (
            *("hard.c", "hard.concave-corner", "hard.contrast", "hard.convex-kink", "hard.deep", "hard.free-end"),
            *("hard.node-hit", "hard.offset", "hard.short-segment", "hard.steep-slave", "hard.stiff", "hard.touch"),
            "hard.zero-load",
        ),
        HARD,
    ),
    **dict.fromkeys(("newton.history", "newton.order", "tangent.directional"), DERIVATIVE),
    **dict.fromkeys(("patch.flat.nodal", "patch.flat.normal", "patch.flat.normal.solve"), CLASS),
    **dict.fromkeys(("patch.flat.published", "patch.flat.resultant"), CLASS),
    **dict.fromkeys(("patch.flat.single", "patch.flat.single.solve"), CLASS),
    "patch.tilted.nodal": TILTED,
    **dict.fromkeys(("nodal-push", "projection.activity", "projection.segment"), POINTS),
    **dict.fromkeys(("newton.units", "units"), UNITS),
    **dict.fromkeys(("newton.attainable", "stability.local", "stability.stiffness"), DIGITS),
    **dict.fromkeys(("stability.sweep", "stability.translation"), DIGITS),
    **dict.fromkeys(("objectivity", "swap"), SIDES),
    "complementarity": "A pairing that is wrong in a solution is wrong at single states, and `unilateral` asks there.",
}
