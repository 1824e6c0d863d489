"""Make the picture of an arm as plain data, for the markers of a node and the page of `view`."""
