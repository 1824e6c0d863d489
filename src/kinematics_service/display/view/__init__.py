"""
The arm as a picture: what is to be seen of a pose as plain data, and a web page that shows it.
"""
