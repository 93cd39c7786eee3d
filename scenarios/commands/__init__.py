"""The subcommands of `oilsim`.

Each has a function `register(commands)`, which adds its parser and sets the parser's default `command`: a function of the parsed options
that returns the exit code. A subcommand imports its needs when it runs, so that listing and checking start fast.
"""
