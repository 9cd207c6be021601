//! Scene files of overfly: RON in, resolved settings out; presets.
