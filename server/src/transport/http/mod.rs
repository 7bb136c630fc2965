//! The handlers of the HTTP interface, a module for each part of it.

pub(crate) mod admin;
pub(crate) mod atlas;
pub(crate) mod effects;
pub(crate) mod finger;
pub(crate) mod info;
pub(crate) mod page;
pub(crate) mod replay;
pub(crate) mod sed;
pub(crate) mod xr;
