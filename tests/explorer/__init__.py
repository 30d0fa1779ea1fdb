"""The explorer: its numbers, what the user does in it, how it looks, its file."""
