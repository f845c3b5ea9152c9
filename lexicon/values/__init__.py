"""Values from outside: bounded reading of text, CSV, TOML and JSON, and checks of what was read."""
