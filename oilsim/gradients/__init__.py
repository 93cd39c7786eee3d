"""Sums over neighbours, and the corrections that make their gradients exact."""
