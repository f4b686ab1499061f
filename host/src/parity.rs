//! Whether the compiled model decides as the full model does.
