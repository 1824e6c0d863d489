"""
Show an arm live on a web page: its visible content as plain data, drawn with viser.
"""
