"""What the co-simulation master can step: the fluid, pybullet's rigid bodies, FMUs."""
