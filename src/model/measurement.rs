//! Measurements: what was read, and what must vanish.

use super::columns::Columns;
use super::leaf::{Map, Quantity};
use super::read::{Entry, Fields, Reader, plain_records, record};
use super::text::Text;
use super::tree::{Body, Kind, Node};

record! {
    /// A kind of measurement. One row of its data is one instance.
    "a measurement"
    pub struct Measurement {
        /// The files of its data; one may be written as text alone.
        pub data: DataFiles,
        /// The columns of names, for families.
        pub keys: Vec<Text>,
        /// The columns of numbers; several of one kind may stand together.
        pub inputs: Columns<Input>,
        /// Named expressions; each sees the ones before.
        pub define: Map<Text>,
        /// Correlations between the errors of two inputs, by their names: `{"x, y": 0.5}`.
        pub correlations: Map<Quantity>,
        /// What must vanish.
        pub residuals: Map<Residual>,
        /// What large residuals count.
        pub loss: Option<Loss>,
        /// What `evaluate` prints.
        pub outputs: Map<Text>,
        /// Derivatives derived by hand, to be checked: of what, by what, the formula.
        pub derivatives: Map<Map<Text>>,
    }
}

record! {
    /// A quantity read from a column.
    "an input"
    pub struct Input {
        /// The unit of the column; without one, a plain number.
        pub unit: Option<Text>,
        /// Its standard deviation, perhaps an expression of inputs; without one, it is exact.
        pub sigma: Option<Quantity>,
        /// What is subtracted from the reading.
        pub bias: Option<Quantity>,
        /// The value where the column is absent.
        pub default: Option<Quantity>,
        /// What its errors have in common with those of other inputs, such as the sensor: for variance components.
        pub group: Option<Text>,
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
        /// Whether the first line is skipped although `columns` names the columns.
        pub header: bool,
        /// Whether it is fitted, or kept for `evaluate --check`.
        pub role: DataRole,
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

record! {
    /// What large residuals count: less than their squares.
    "a loss"
    pub struct Loss {
        /// Its name, such as `huber`.
        pub kernel: Text,
        /// Its tuning constant, in standard deviations of one number; by default that of 95 % efficiency.
        pub tuning: Option<Quantity>,
        /// `row`, the default: of all residuals of a row together; or `input`: of each corrected input.
        pub of: Option<Text>,
        /// `declared`, the default: by the standard deviations as they are; or `estimated` from the middle of the residuals.
        pub scale: Option<Text>,
    }
}

plain_records!(Measurement, Input);

impl Entry for Loss {
    fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
        match &node.kind {
            Kind::Text(kernel) => Some(Self { kernel: kernel.clone(), span: node.span, ..Self::default() }),
            Kind::Group(None, _) => Self::from_fields(Fields::of(node, Self::WHAT, reader)?, reader),
            _ => reader.wrong(node, "the name of a loss as text, or `(kernel: …, tuning: …)`", None),
        }
    }

    fn write(&self) -> Option<Node> {
        match (&self.tuning, &self.of, &self.scale) {
            (None, None, None) => self.kernel.write(),
            _ => Some(self.to_fields().node(None)),
        }
    }
}

/// What a data file is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DataRole {
    /// To be fitted.
    #[default]
    Calibrate,
    /// Kept out of the fit, to check it by.
    Check,
}

impl Entry for DataRole {
    fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
        match &node.kind {
            Kind::Group(Some(word), Body::Bare) => match word.name.as_str() {
                "Calibrate" => Some(Self::Calibrate),
                "Check" => Some(Self::Check),
                _ => reader.unknown_word(word, "role", &["Calibrate", "Check"]),
            },
            _ => reader.wrong(node, "`Calibrate` or `Check`", None),
        }
    }

    fn write(&self) -> Option<Node> {
        match self {
            Self::Calibrate => None,
            Self::Check => Some(super::read::group(Some("Check"), Body::Bare)),
        }
    }

    fn absent() -> Option<Self> {
        Some(Self::default())
    }
}

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

    fn is_absent(&self) -> bool {
        self.0.is_empty()
    }
}

impl DataFile {
    fn is_bare(&self) -> bool {
        self.columns.is_empty()
            && self.constants.is_empty()
            && !self.optional
            && !self.header
            && self.role == DataRole::Calibrate
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
