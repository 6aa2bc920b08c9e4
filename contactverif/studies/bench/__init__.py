"""Speed against error: what an error costs formulations, in evaluations and in linear systems.

`bench_study` is the job, `bench_plan` the cells and their problems, `cell_runs` what is solved and timed in one of
them, `meter` counters and clock, and `bench_journal` is what survives a kill.
"""
