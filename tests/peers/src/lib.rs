//! Palpate's benchmarks against other software, in `benches/`.
