"""The scenario: what its file says, checked as a whole, loaded, and resolved to what is run."""
