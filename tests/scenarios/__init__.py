"""The stories, each run as a user runs it."""
