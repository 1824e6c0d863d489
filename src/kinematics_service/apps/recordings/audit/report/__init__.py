"""Write the reports of an audit: text, page, document, and a bag of the computed messages."""
