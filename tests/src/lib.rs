//! Whole-system tests: real processes on private ports, one file per promise.
