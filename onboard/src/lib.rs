//! Recognises objects by touch on a microcontroller.
//!
//! `no_std`, without a heap and without `unsafe`; once a model has been validated nothing here can panic.
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

#[cfg(test)]
extern crate std;

pub mod effector;
