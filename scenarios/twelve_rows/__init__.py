"""Twelve rows on one shaft: how mounting them out of phase evens the torque, and what many instances cost."""
