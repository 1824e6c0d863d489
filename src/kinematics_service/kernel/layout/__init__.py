"""How arrays are handed over, and where the numbers stand in them."""
