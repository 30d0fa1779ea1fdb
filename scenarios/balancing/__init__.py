"""What counterweight on a crank, or what spring, evens the crank's torque or the shaking of the machine."""
