"""The plant spacing changed while driving: what it does to each hole."""
