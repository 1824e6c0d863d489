"""What is drawn of an arm, as plain data: for the markers of a node, and for a page."""
