"""How far an arm may be off, and what that makes of pose and twist of its tool."""
