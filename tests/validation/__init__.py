"""Physical validation of the fluid against formulas and published experiments: `make validate`, or `make validate CASE=name`."""
