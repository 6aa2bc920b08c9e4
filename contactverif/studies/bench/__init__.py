"""Speed against error: formulations on scenes with an exact solution, meshes fine and coarse, penalties soft to stiff.

`bench_study` is the job, `bench_scenes` the scenes with their errors, `meter` the clock, and `journal` is what survives
a kill.
"""
