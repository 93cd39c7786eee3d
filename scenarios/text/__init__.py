"""Problems in words, TOML and JSON as text, versions, and the terminal."""
