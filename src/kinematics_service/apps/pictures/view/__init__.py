"""
Show an arm live on a web page; the content is computed as plain data, then drawn with viser.
"""
