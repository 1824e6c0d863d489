"""The clearance from singular poses: a radius in which, by proof, no pose is singular."""
