"""Any sequence of calls under sanitizers, and seasons of planting: minutes and hours in `make soak`, seconds here."""
