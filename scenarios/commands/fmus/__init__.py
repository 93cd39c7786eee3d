"""Subcommands around FMUs: of an exercise, of a model of one equation, and the signals that they may take."""
