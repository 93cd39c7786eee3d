"""Reading a recording back, checking, comparing and repairing it."""
