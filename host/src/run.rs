//! The whole way: capture, train, export, recognise, report.
