"""
Draw pictures of an arm with matplotlib: poses, paths, maps of the distance, workspaces.
"""
