"""Windows against particles everywhere and against formulas."""
