"""Sets the bench up: virtual environment, ROS 2 packages, workspace, byte code."""
