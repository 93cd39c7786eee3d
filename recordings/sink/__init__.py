"""Writing of recordings, and the live viewer."""
