"""The fluid as users meet it: what goes in, how it advances, what can be read."""
