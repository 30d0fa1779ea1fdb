"""The FMUs in hosts that others wrote, and on other platforms."""
