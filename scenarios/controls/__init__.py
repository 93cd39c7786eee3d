"""Controls and signals: what may be changed in a run, and the numbers of a run by name."""
