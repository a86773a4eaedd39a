"""Runs of the node graph: preparation, launching of the processes, node parameters, and replay over DDS."""
