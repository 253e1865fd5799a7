//! The guide, as it stands in `docs/`.
#![doc = include_str!("../docs/README.md")]

/// The first instrument, from a starter to a report.
pub mod first {
    #![doc = include_str!("../docs/first.md")]
}

/// Derivatives that were derived by hand, or by another program.
pub mod jacobians {
    #![doc = include_str!("../docs/jacobians.md")]
}

/// What can be known before anything is measured.
pub mod before {
    #![doc = include_str!("../docs/before.md")]
}

/// Robots from tables and URDF files, and back.
pub mod import {
    #![doc = include_str!("../docs/import.md")]
}

/// The language of model files.
pub mod language {
    #![doc = include_str!("../docs/language.md")]
}

/// The mathematics, with sources.
pub mod theory {
    #![doc = include_str!("../docs/theory.md")]
}

/// A new operation, loss, solver or joint.
pub mod extending {
    #![doc = include_str!("../docs/extending.md")]
}
