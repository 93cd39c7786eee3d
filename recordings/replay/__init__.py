"""Reading, checking, comparing and repairing recordings."""
