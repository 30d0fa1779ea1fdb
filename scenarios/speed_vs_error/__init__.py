"""What an answer costs and how exact it is: coupling, the cost of a step, solving, hard cases. One report."""
