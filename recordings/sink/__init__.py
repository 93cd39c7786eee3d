"""Writing a recording, and the live viewer."""
