"""Model, design, control and recording of a flexible air-breathing hypersonic vehicle; needs no ROS."""
