"""Viscosity: the implicit system, the bodies' response, and viscosity that is deferred."""
