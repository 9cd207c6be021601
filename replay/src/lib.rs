//! Recorded flights of overfly: format, importers, digests.
