"""What the stories share: the driver of the linkage FMU, the command line, tables and figures, what times allow to be said, the operating point."""
