//! Learned policies for POGEMA environments, which play on all cores and without Python.

/// The README, whose example the tests compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
