"""Checks of a run against laws of physics; each takes a scene, a watched world, a scenario run or a recording first."""
