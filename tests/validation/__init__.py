"""`linkage-fmu validate`, with FMUs that are wrong in one way each."""
