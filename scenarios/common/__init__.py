"""What the stories share: driver of the linkage FMU, command line, tables and figures, operating point, timing."""
