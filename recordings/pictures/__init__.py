"""Pictures that are drawn from a recording."""
