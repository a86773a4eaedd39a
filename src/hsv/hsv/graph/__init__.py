"""The graph of nodes, described once as data, and the launcher of its processes."""
