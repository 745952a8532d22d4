//! Claims about fits, files, poses and trees.
