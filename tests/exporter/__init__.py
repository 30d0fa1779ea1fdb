"""The FMUs as files: description, binaries, sources, archive, wheel; and the command that makes them."""
