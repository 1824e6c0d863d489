"""Read datasets for robot learning: episodes in LeRobot folders, parquet, HDF5 and npz files."""
