//! A page that shows what was measured.
