"""Images of a board, and the intrinsics of the camera that took them."""
