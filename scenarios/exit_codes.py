"""Exit codes of the `oilsim` command: done, failed (the recording up to then is kept), bad input, and Ctrl-C as shells count it."""

DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
