"""How the `oilsim` command ends: done, failed (a run keeps its recording so far), bad input, or Ctrl-C, as a shell counts it."""

DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
