//! Pure functions of samples.
