"""Subcommands that make FMUs: of an exercise, and of a model of one equation."""
