"""From interface.toml and the C sources to the .fmu: table, description, documentation, binaries, archive."""
