"""What drives FMUs for the tests: hosts in Python (host.py, host3.py) and in C, motions, and lives to tell."""
