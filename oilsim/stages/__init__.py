"""The stages of a time step, each a function in a file of its own; `oilsim.fluid.schemes` has their order."""
