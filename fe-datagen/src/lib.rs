//! Finite-element fingertip: scenes, solver, atlas, dataset.
