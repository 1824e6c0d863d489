"""Find a board in images, and read the intrinsics of the camera that took the images."""
