"""Signals: numbers of a run by name, for FMUs and for orders."""
