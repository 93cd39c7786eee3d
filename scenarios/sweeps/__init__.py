"""Many runs of one scenario, and their results side by side."""
