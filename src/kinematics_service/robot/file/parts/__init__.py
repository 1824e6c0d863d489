"""Read the sections of a robot file: joints, table, loops, points, singularity and others."""
