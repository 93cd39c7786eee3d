"""From a mesh to a solid, and from a solid to wall particles: reading, signed distance, sampling, hydrostatics and added mass."""
