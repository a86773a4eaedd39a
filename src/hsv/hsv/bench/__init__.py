"""What the bench is measured against: the same work done by other means, timed in the same run."""
