"""Cells, neighbour lists and smoothing kernels."""
