"""Read datasets of robot learning: episodes of LeRobot folders, parquet, HDF5 and npz files."""
