"""The 50-digit mechanism that the FMU is held against."""
