"""How near an arm is to a singular pose."""
