"""Liquids, settings, the state of a fluid, and quantities with units and limits: all rooms may know them."""
