"""The published planting cycle, the parameter studies of the paper, and its sentences beside what the FMU gives."""
