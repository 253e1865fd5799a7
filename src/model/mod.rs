//! What a model file says, before any mathematics.
//!
//! [`load()`] reads a text into a [`Model`], or says everything that is wrong with it; [`print()`] writes one in canonical form, and
//! what it writes loads as an equal model. Expressions and quantities stay text here. Every name and every leaf knows its bytes
//! in the file, so that whoever understands them later can point at them; equality leaves the places out.
//!
//! ```
//! use phical::{diag::Source, model::{load, print}};
//!
//! let source = Source::new("arm.ron", r#"(name: "arm", define: {"k": "2*scale"})"#);
//! let (model, warnings) = load(&source).expect("it is right");
//! assert!(warnings.is_empty());
//! assert_eq!(model.define.get("k").unwrap().value, "2*scale");
//! assert_eq!(load(&Source::new("again", print(&model))).unwrap().0, model);
//! ```
#![doc = "\n\n# Language reference\n\n"]
#![doc = include_str!("../../docs/language.md")]

mod chain;
mod columns;
mod leaf;
mod load;
mod measurement;
mod mend;
mod parameter;
mod print;
mod raw;
mod read;
mod scenario;
mod text;
mod tree;
mod value;

#[cfg(test)]
mod tests;

pub use chain::{DhRow, Joint, PhiJoint, Reads, Rigid};
pub use columns::Columns;
pub use leaf::{Components, Map, Number, Quantity};
pub use load::load;
pub use measurement::{DataFile, DataFiles, DataRole, Input, Loss, Measurement, Residual};
pub use parameter::{Parameter, Shape};
pub use print::print;
pub use scenario::{Draw, Experiment, Noise, Scenario, Solve, Zero};
pub use text::Text;
pub use value::{Component, Setting, Value, Values};

use read::{optional_records, record};

record! {
    /// A model file.
    "a model"
    pub struct Model {
        /// Its name.
        pub name: Text,
        /// Where it comes from.
        pub source: Option<Text>,
        /// What it is about.
        pub description: Option<Text>,
        /// What a number without a unit means.
        pub units: Units,
        /// What counts as known well enough.
        pub tolerances: Tolerances,
        /// Lists of joints.
        pub chains: Map<Vec<Joint>>,
        /// Free-standing parameters.
        pub parameters: Map<Parameter>,
        /// Functions: `"f(a, b)"` and their expression.
        pub functions: Map<Text>,
        /// Named expressions that every measurement may use.
        pub define: Map<Text>,
        /// Conditions that the parameters meet.
        pub constraints: Map<Text>,
        /// What was measured and what must vanish.
        pub measurements: Map<Measurement>,
        /// How data are made up.
        pub scenarios: Map<Scenario>,
    }
}

record! {
    /// What a number without a unit means.
    "`units`"
    pub struct Units {
        /// The unit of lengths.
        pub length: Option<Text>,
        /// The unit of angles.
        pub angle: Option<Text>,
        /// The unit of times.
        pub time: Option<Text>,
        /// The unit of masses.
        pub mass: Option<Text>,
        /// The unit of temperatures.
        pub temperature: Option<Text>,
    }
}

record! {
    /// What counts as known well enough, by dimension.
    "`tolerances`"
    pub struct Tolerances {
        /// Of lengths.
        pub length: Option<Quantity>,
        /// Of angles.
        pub angle: Option<Quantity>,
        /// Of times.
        pub time: Option<Quantity>,
        /// Of masses.
        pub mass: Option<Quantity>,
        /// Of temperatures.
        pub temperature: Option<Quantity>,
        /// Of plain numbers.
        pub number: Option<Quantity>,
    }
}

optional_records!(Units, Tolerances);
