"""The clearance: a radius around a pose in which, by proof, no pose is singular."""
