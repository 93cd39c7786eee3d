"""Pictures drawn from a recording."""
