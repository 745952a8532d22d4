//! Claims about the technique.
