"""The scenarios that oilsim ships, as TOML files."""
