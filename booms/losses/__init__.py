"""Closures for the ways in which a boom loses oil that particles are too coarse to resolve; `docs/losses.md` tells their limits."""
