"""The cases that others get wrong, each with its worst value and its bound: what the tests assert, the report shows."""
