"""Oil booms: their sections and segments, how they are laid out, and how much oil they hold."""
