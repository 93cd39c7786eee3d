"""A moving box of particles inside the analytic sea: the particles carry what bodies and oil change, the sea carries itself."""
