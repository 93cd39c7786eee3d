"""The stages of a time step, each a function in a file of its own; `oilsim.step.schemes` has their order."""
