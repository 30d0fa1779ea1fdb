"""Inverse dynamics: what torque, inertia and bias of the moving masses cost and how exact they are, beside peers."""
