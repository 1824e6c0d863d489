"""Joint positions and joint velocities that reach what is asked of the tool."""
