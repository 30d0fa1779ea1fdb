"""The mechanism in numpy, its FMU, and the printed equations."""
