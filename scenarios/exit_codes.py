"""How the `oilsim` command ends: done, failed (a run keeps its recording so far), or bad input."""

DONE, FAILED, BAD_INPUT = 0, 1, 2
