"""Commands that talk to a node: the demo, `echo`, the view."""
