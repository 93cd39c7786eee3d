"""The scenario file becomes a run; the oilsim command."""
