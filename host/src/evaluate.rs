//! How often, and after how many touches, a model is right.
