"""What 3D packages open: skeletons with a figure to look at, cameras and markers as glTF and USD."""
