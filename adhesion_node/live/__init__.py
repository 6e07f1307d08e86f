"""The live page: what the nodes say, in a browser, while they run."""
