"""Subcommands that show what a scenario may name: oils and booms."""
