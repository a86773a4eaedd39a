"""How far the results carry: strips over what the paper leaves open, until each controller is lost."""
