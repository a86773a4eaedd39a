"""How far the results carry: sweeps over what the paper leaves open, until each controller is lost."""
