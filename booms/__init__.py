"""Oil booms: their segments, deployment and how much oil they hold."""
