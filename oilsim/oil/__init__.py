"""The ledger of a run's oil: every litre that was spilled, by its fate."""
