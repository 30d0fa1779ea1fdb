"""What each way of giving the crank to the FMU brings, by step; and the smoothing of a noisy angle."""
