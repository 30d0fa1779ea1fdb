"""The pure part: geometry, derivatives, directions."""
