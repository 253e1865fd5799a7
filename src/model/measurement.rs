//! Measurements: what was read, and what must vanish.

use super::leaf::{Map, Quantity};
use super::read::{Entry, Fields, Reader, plain_records, record};
use super::tree::{Kind, Node, Text};

record! {
    /// A kind of measurement. One row of its data is one instance.
    "a measurement"
    pub struct Measurement {
        /// The files of its data; one may be written as text alone.
        pub data: DataFiles,
        /// The columns of names, for families.
        pub keys: Vec<Text>,
        /// The columns of numbers.
        pub inputs: Map<Input>,
        /// Named expressions; each sees the ones before.
        pub define: Map<Text>,
        /// What must vanish.
        pub residuals: Map<Residual>,
        /// What `evaluate` prints.
        pub outputs: Map<Text>,
    }
}

record! {
    /// A quantity read from a column.
    "an input"
    pub struct Input {
        /// The unit of the column; without one, a plain number.
        pub unit: Option<Text>,
        /// Its standard deviation; without one, it is exact.
        pub sigma: Option<Quantity>,
        /// What is subtracted from the reading.
        pub bias: Option<Quantity>,
        /// The value where the column is absent.
        pub default: Option<Quantity>,
    }
}

record! {
    /// A file of data.
    "a data file"
    pub struct DataFile {
        /// The path, relative to the model file.
        pub file: Text,
        /// The names of the columns, where the file has no heading; `_` skips one.
        pub columns: Vec<Text>,
        /// Keys and inputs that are the same for the whole file.
        pub constants: Map<Quantity>,
        /// Whether it may be absent.
        pub optional: bool,
    }
}

record! {
    /// An expression that must vanish.
    "a residual"
    pub struct Residual {
        /// The expression.
        pub value: Text,
        /// Its standard deviation.
        pub sigma: Option<Quantity>,
    }
}

plain_records!(Measurement, Input);

/// The files of a measurement: `"vo.csv"`, or a list of paths and `(file: …)`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DataFiles(pub Vec<DataFile>);

impl Entry for DataFiles {
    fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
        match &node.kind {
            Kind::List(_) => Vec::read(node, reader).map(Self),
            Kind::Text(_) => Some(Self(vec![DataFile::read(node, reader)?])),
            _ => {
                reader.wrong(node, "a path or a list of files", Some("write \"data.csv\" or [(file: \"data.csv\", …)]"))
            }
        }
    }

    fn write(&self) -> Option<Node> {
        match &self.0[..] {
            [one] if one.is_bare() => one.file.write(),
            _ => self.0.write(),
        }
    }

    fn absent() -> Option<Self> {
        Some(Self::default())
    }
}

impl DataFile {
    fn is_bare(&self) -> bool {
        self.columns.is_empty() && self.constants.is_empty() && !self.optional
    }
}

impl Entry for DataFile {
    fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
        if let Kind::Text(file) = &node.kind {
            return Some(Self { file: file.clone(), span: node.span, ..Self::default() });
        }
        Self::from_fields(Fields::of(node, Self::WHAT, reader)?, reader)
    }

    fn write(&self) -> Option<Node> {
        Some(self.to_fields().node(None))
    }
}

impl Entry for Residual {
    fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
        match &node.kind {
            Kind::Text(value) => Some(Self { value: value.clone(), sigma: None, span: node.span }),
            Kind::Group(..) => Self::from_fields(Fields::of(node, Self::WHAT, reader)?, reader),
            _ => reader.wrong(node, "an expression as text, or `(value: …, sigma: …)`", None),
        }
    }

    fn write(&self) -> Option<Node> {
        match self.sigma {
            None => self.value.write(),
            Some(_) => Some(self.to_fields().node(None)),
        }
    }
}
