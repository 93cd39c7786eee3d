"""Loads of a sea on floating bodies without particles: buoyancy and wave pressure on the wetted mesh, added mass, drag and wind."""
