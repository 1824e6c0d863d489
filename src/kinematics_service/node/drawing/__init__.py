"""The picture of an arm as plain data, for the markers of a node and for the page of `view`."""
