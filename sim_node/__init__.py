"""A simulated train: scenarios, the true motion, the sensors and the node that publishes them."""
