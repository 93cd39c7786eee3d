"""Interfacial tension between liquids."""
