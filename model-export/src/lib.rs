//! Checks, evaluates and describes exported Papilla models.
