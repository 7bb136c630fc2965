//! Wire contract of Papilla: frames, messages, maps, atlas.
