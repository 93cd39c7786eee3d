"""Short runs whose every bit is on record, so that a change of the code's shape shows that it changed nothing else."""
