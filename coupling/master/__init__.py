"""The co-simulation master: steps, connections, exchange with bodies, ledger and observers."""
