"""Bare ROS 2 processes with the topics and message sizes of the graph, and nothing else in them."""
