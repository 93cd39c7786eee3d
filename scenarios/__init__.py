"""Scenarios: a scenario file becomes a run, by the `oilsim` command or from Python."""
