"""What a communication step costs, by what it sets and reads, in a C host and through fmpy."""
