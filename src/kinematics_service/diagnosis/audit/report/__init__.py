"""An audit on paper: text, page, document, and a bag of what was computed."""
