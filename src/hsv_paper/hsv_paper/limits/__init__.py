"""Physical limits of the vehicle by optimal control: the fastest transfer, and the deepest recoverable fault."""
