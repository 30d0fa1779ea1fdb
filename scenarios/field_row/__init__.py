"""A row of plants: the linkage between a drivetrain, a conveyor and the soil, run by our masters and by engines of others."""
