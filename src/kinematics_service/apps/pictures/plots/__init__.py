"""
Pictures of an arm: poses, paths, maps of distance, workspace. Only here is matplotlib imported.
"""
