"""Compilation of kernels, their vectors, and the threads that share their work."""
