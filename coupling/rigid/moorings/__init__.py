"""Mooring legs: elastic catenaries of several parts from a body down to an anchor on the ground."""
