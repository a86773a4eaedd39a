"""What every node of the bench shares: lockstep links, parameters, message conversion, start and stop."""
