"""The bodies of a scenario as solids: their shapes, places and motions, and what is too thin for the particles."""
