//! Unifies the features of shared dependencies; holds no code.

#![forbid(unsafe_code)]
