"""Why a formula is wrong: the likely slips, each tested."""
