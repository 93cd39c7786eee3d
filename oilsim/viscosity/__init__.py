"""Viscosity: stiffness of pairs, the implicit system, the response of bodies, and viscosity that is deferred."""
