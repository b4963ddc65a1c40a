"""Files of other programs: URDF and MJCF, read and written, with their meshes."""
