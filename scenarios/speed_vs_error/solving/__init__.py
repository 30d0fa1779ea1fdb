"""What one evaluation of the linkage costs and how exact it is: ours beside what a user would reach for."""
