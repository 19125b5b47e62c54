"""ROS 2 node of a laser-spot range sensor."""
