"""The bounded pressure solve, its gradient, and how walls and rigid bodies respond to it."""
