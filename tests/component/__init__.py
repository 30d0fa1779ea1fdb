"""One instance between calls: the crank carried on, travel, forces, poses out of reach."""
