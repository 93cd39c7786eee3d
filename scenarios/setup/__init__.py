"""Setup: from a scenario to the simulators, with fluid, bodies, vessels and booms in their places."""
