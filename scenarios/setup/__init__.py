"""From a scenario to simulators: fluid, bodies, vessels and booms in their places."""
