"""Rigid bodies tied by joints and lines: their state, constrained mobility, loads of a sea, and the step that needs no contacts."""
