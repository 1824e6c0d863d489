"""
The arm as a picture: the visible content of a pose as plain data, and a web page that shows it.
"""
