"""From a mesh to wall particles: sampling, signed distance, hydrostatics and added mass."""
