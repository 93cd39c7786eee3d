"""The subcommands of `oilsim`, one in each module.

Each module has `register(commands)`, which adds its parser and sets the parser's default `command`: a function that takes the parsed
options and returns the exit code. A subcommand imports what it needs when it runs, so that `list` and `check` start fast.
"""
