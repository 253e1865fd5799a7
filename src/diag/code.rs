//! The table of everything that can be reported. Adding a row is all it takes to add a code.

use std::fmt;

/// Whether the run can go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// It cannot.
    Error,
    /// It can, and the output says so.
    Warning,
}

impl Severity {
    /// `error` or `warning`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warning => "warning",
        }
    }
}

macro_rules! codes {
    ($($variant:ident $id:literal $title:literal $explanation:literal)*) => {
        /// Which kind of mistake or warning. Codes keep their number for ever.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Code {
            $(#[doc = concat!($id, ": ", $title, ".\n\n", $explanation)] $variant,)*
        }

        impl Code {
            /// Every code, in the order of the table.
            pub const ALL: &[Self] = &[$(Self::$variant),*];

            const fn row(self) -> (&'static str, &'static str, &'static str, &'static str) {
                match self {
                    $(Self::$variant => ($id, $title, $explanation, include_str!(concat!("examples/", $id, ".txt"))),)*
                }
            }
        }
    };
}

impl Code {
    /// The number people quote: `E012`.
    #[must_use]
    pub const fn id(self) -> &'static str {
        self.row().0
    }

    /// A few words.
    #[must_use]
    pub const fn title(self) -> &'static str {
        self.row().1
    }

    /// A paragraph with an example of the mistake and its cure.
    #[must_use]
    pub const fn explanation(self) -> &'static str {
        self.row().2
    }

    /// What a mistake of the kind looks like: a message as it is shown, from a case of the project's tests.
    #[must_use]
    pub const fn example(self) -> &'static str {
        self.row().3
    }

    /// The code of a number, in either case: `e012`.
    #[must_use]
    pub fn from_id(id: &str) -> Option<Self> {
        let known = |code: &&Self| code.id().eq_ignore_ascii_case(id.trim());
        Self::ALL.iter().find(known).copied()
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.id())
    }
}

codes! {
    Syntax "E001" "the file is not RON"
        "A bracket, a comma, a colon or a quote is missing or too many. After `a: 1 b: 2` write the comma: `a: 1, b: 2`. Values without a name cannot be followed by named ones: `Free(0, min: -1)` is written `Free(nominal: 0, min: -1)`."
    UnreadableFile "E002" "a file cannot be read"
        "There is no such file, it may not be opened, or it is not UTF-8 text. Paths inside a model are relative to the model file. A file saved in another encoding (Latin-1, UTF-16) has to be saved again as UTF-8."
    UnknownField "E003" "there is no such field"
        "The name before a colon is not one that may stand here. `Revolute(name: \"L1\", alhpa: 0)` is cured by writing `alpha`; the hint lists the legal names."
    MissingField "E004" "a required field is missing"
        "`Model(chains: {})` has no `name`; `Fixed(phi: 0)` neither. Add the field: `Fixed(name: \"L0\", phi: 0)`."
    WrongKind "E005" "the value is of the wrong kind"
        "A number stands where text is wanted, a list where a map is wanted, and so on. Lists are `[…]`, maps `{\"key\": value}`, structures `(field: value)`, vectors `(x, y, z)`. `keys: \"hole\"` is cured by `keys: [\"hole\"]`."
    UnknownVariant "E006" "there is no such joint, parameter kind or wrapper"
        "The name before a bracket is not known here. Joints are `Revolute`, `Prismatic`, `Fixed`, `Rigid`, `Dh`, `ModifiedDh`; parameters `Scalar`, `Vec3`, `Rotation`, `Pose`; values `Free`, `Held`. `Revolut(…)` is cured by `Revolute(…)`."
    Duplicate "E007" "a name is given twice"
        "A map has the same key twice, a structure the same field twice, or two joints of the file have the same name. Only one of them could count, so neither does: remove or rename one."
    NestedTooDeep "E008" "brackets are nested too deeply"
        "No model needs more than ten brackets inside one another. The file is damaged, or it is not a model. An expression with hundreds of brackets is cured by naming its parts in `define`."
    NotFinite "E009" "a number is not finite"
        "`NaN`, `inf` and numbers beyond 1.8e308, such as `1e400`, are no measures of anything. For a bound that does not exist leave the field out."
    BadExpression "E010" "an expression cannot be read"
        "The text is not an expression: a bracket is open, an operator lacks a side, a character means nothing here. `\"2 * (a + b\"` is cured by closing the bracket. Multiplication is written: `2*a`, not `2 a`."
    UnknownUnit "E011" "there is no such unit"
        "Known are m mm cm dm km um µm nm in ft, rad mrad urad µrad deg ° gon mgon arcmin arcsec turn, s ms us µs ns min h, kg g, K, ppm ppb % px 1, and products such as mm/s. `\"5 millimetre\"` is cured by `\"5 mm\"`."
    WrongUnit "E012" "the unit does not fit"
        "The unit measures something else than the place wants: `alpha: \"5 mm\"` gives a length to an angle. Write a unit of the right kind, such as `\"5 mrad\"`."
    UnknownName "E013" "there is no such name"
        "An expression uses a name that is no input, definition, parameter, chain or function visible from here. Definitions see only those before them. A misspelt `triangualte(l, r)` is cured by `triangulate(l, r)`."
    WrongArity "E014" "the number of arguments is wrong"
        "A function wants as many arguments as it declares, a chain one for each moving joint: a chain with two revolute joints is called `left(hz, v)`, not `left(hz)`."
    WrongShape "E015" "the shape does not fit"
        "A vector, rotation or frame stands where a scalar is wanted, or the other way about. `sqrt(p)` of a vector `p` is cured by `sqrt(dot(p, p))` or `norm(p)`; a frame's point is `F.o`."
    WrongDimension "E016" "the dimensions do not fit"
        "Millimetres cannot be added to seconds, nor a length be given to `sin`. A bare number takes no part in a sum with a length: write `x + 5 mm`, not `x + 5`."
    Circular "E017" "a definition depends on itself"
        "A definition, a function or a tie leads back to itself: `\"a\": \"b + 1\", \"b\": \"a\"`. Break the circle by giving one of them a value."
    UnusedParameter "E018" "a free parameter is used by nothing"
        "No residual depends on it, so no data can determine it. Use it, hold it with `Held(…)`, or remove it."
    BadBounds "E019" "the bounds contradict each other"
        "`min` is above `max`, or the nominal value lies outside them: `Free(nominal: 2, min: 0, max: 1)`. Correct the one that is wrong; remember that numbers without a unit are in the model's unit."
    NotPositive "E020" "a sigma or tolerance is not positive"
        "A standard deviation or tolerance of zero or less means nothing. For an input without error leave `sigma` out; a parameter that is known exactly is `Held(…)` or a constant."
    NameTaken "E021" "the name is taken"
        "A definition, input or function has the name of a core function, a constant, a chain or something else visible in the same place, as in `define: {\"sin\": \"…\"}`. Choose another."
    UnknownParameter "E022" "there is no such parameter"
        "`--fix`, `--free`, a start file or a scenario names a parameter that the model has not. Names are `joint.symbol` (`L1.alpha`), `target.x`, `socket[front/0].x`, or `socket[*]`."
    NotAdjustable "E023" "the parameter cannot be freed or fixed"
        "It is a constant or a tie. Only `Free(…)` and `Held(…)` can be freed or held: write `alpha: Held(\"pi/2\")` to be able to free it."
    UnknownMeasurement "E024" "there is no such measurement"
        "`--data M=FILE`, `--rows M=N` or a scenario names a measurement that the model has not. The hint lists those it has."
    UnknownScenario "E025" "there is no such scenario"
        "The model declares no scenario of this name, or none at all. Add one under `scenarios`, which `simulate` needs."
    NoResiduals "E026" "nothing must vanish"
        "A model to be calibrated states what must be zero: at least one measurement has `residuals: {\"name\": \"expression\"}`."
    DataFileMissing "E027" "a data file is missing"
        "The file named by `data` or `--data` is not there. Paths in the model are relative to the model file, those on the command line to the working directory. A file that may be absent says `optional: true`."
    ColumnMissing "E028" "a column is missing"
        "The table lacks a column for an input or key. Rename the column, name the columns by `columns: […]` if the file has no heading, or give the input a `default`."
    ColumnUnknown "E029" "a column belongs to nothing"
        "`columns` or `constants` names something that is neither an input nor a key of the measurement. Write `\"_\"` for a column to be skipped."
    ColumnTwice "E030" "a column stands twice"
        "Two columns of the table have the same name, or a column is also given as a constant of the file, so it is not clear which counts. Rename or skip one."
    EmptyCell "E031" "a cell is empty"
        "Every input needs a value in every row. Fill the cell in or remove the row; to use a default for the whole file, remove the column."
    NotANumber "E032" "a cell is not a number"
        "Numbers are written `-12.5` or `1e-3`, with a point, without unit and without thousands separators. `12,5` in a comma-separated file becomes two cells."
    DataNotFinite "E033" "a cell is not finite"
        "`NaN`, `inf` or a number beyond 1.8e308 stands in the data. Remove the row: a missing reading is not a reading."
    FieldCount "E034" "a row has the wrong number of fields"
        "Every row has as many fields as the heading or `columns` names. A comma used as decimal point and a missing quote are the usual causes."
    NoRows "E035" "the table has no rows"
        "The file has no heading or nothing below it. Without rows a measurement determines nothing; leave the measurement out instead."
    BadAngle "E036" "an angle in degrees, minutes and seconds cannot be read"
        "Angles of a column with unit `d-m-s` are `12-34-56.7`, `12 34 56.7` or `12°34'56.7\"`, with minutes and seconds below 60; a minus stands before the degrees. For decimal degrees declare `unit: \"deg\"`."
    UndefinedAtStart "E037" "a residual is undefined at the start"
        "At the starting values an expression has no value or no derivative: the root or logarithm of something not positive, a division by zero, the norm of a zero vector, parallel lines of sight. Start elsewhere, or correct the row of data named."
    TooLarge "E038" "the model is too large"
        "The model leads to more operations, unknowns or rows than this program handles. Name common parts in `define`, which are computed once, hold parameters or members by `--fix`, or split the measurement."
    InputWithoutValue "E039" "a scenario leaves an input without a value"
        "Every input of a simulated measurement is drawn (`draw`), set by a formula (`set`) or solved for (`solve`). Add it to one of them, or give the input a `default`."
    CannotSolve "E040" "the inputs cannot be solved for"
        "No values of the unknown inputs make `zero` vanish: the target is out of reach, the starting values are too far away, or there are more equations than unknowns. Draw from a smaller volume or start nearer."
    BadFitFile "E041" "the fit file does not fit"
        "The file is not a fit or a JSON object of name and value, or it belongs to another model. Write it again with `calibrate --out` from this model."
    NotAvailable "E042" "not available"
        "The option exists but this version cannot do it yet, or not for this model. The message says which other way there is."
    CannotWrite "E043" "the output cannot be written"
        "The directory does not exist, the file may not be written, or the disk is full. Nothing was lost but the output itself."
    SigmaMissing "E044" "a sigma is missing"
        "`--weights sigma` divides each residual by its standard deviation, so each needs one: `\"vo\": (value: \"p1 - p2\", sigma: \"0.1 mm\")`. Without them use `--weights unit`."
    SigmaOfParameter "E045" "a sigma depends on a parameter"
        "A standard deviation may be an expression of inputs, `sigma: \"0.5 mm + 2e-6*length\"`, but not of what is estimated: the fit could make its own errors large. Use constants and inputs; to learn how large errors are, group them and ask for `--variance-components`."
    BadCovariance "E046" "the correlations make no sense"
        "A correlation lies between −1 and 1, stands between two different inputs that have a sigma, and all together are such as errors can have (a positive definite matrix): a and b, and b and c, cannot both be correlated by 0.9 while a and c are by −0.9."
    BadSigma "E047" "a sigma of a row is not positive"
        "The expression of a standard deviation gives zero, a negative number or no number in a row of the data. Correct the row, or the expression."
    NoNoise "E048" "a residual has no noise"
        "Under propagated weights a residual counts by the errors that its inputs carry into it. This one depends on no input with a sigma and has none of its own, so it would count without limit. Give one of its inputs a sigma, or itself: `\"r\": (value: \"…\", sigma: \"0.1 mm\")`. Where the equations do depend on such inputs, it may be the start: at some geometries, such as unknown points that all start at the origin, they do not change with a reading. Then declare nominal values nearer to the truth."
    NothingLeft "E049" "a robust loss removes all data"
        "At the starting values every row is so far off that the loss gives it no weight, so nothing can be estimated. Start nearer, take a loss that never rejects (`huber`, `cauchy`) first, or let the scale be estimated."
    ConstantConstraint "E050" "a constraint depends on no parameter"
        "It holds or fails whatever the parameters are: `\"1 mm <= 3 mm\"`, or `\"a - a <= b\"` where `b` is a constant of a chain. Name the parameters that it is about, and declare what it shall restrict `Free(…)` or `Held(…)`."
    ImpossibleConstraint "E051" "a constraint holds nowhere"
        "No values of the parameters meet it, such as `\"3 mm <= a <= 1 mm\"` or a component of `\"vec(a, 0, 1) = vec(b, 0, 2)\"`. Correct the numbers; those without a unit are plain numbers."
    BrokenConstraint "E052" "a constraint among held parameters is not met"
        "All parameters that it names are held, and their values contradict it, so that no estimate can meet it. Correct a value, free one of them with `--free`, or remove the constraint."
    ConstraintMember "E053" "a constraint names a member that no row has"
        "`socket[a]` in a constraint is the member of that very name, and no row of the data names it, so it is not part of the problem. Names are compared as they stand, `a` is not `A`; keys of several columns are joined, `'front/0'`."
    Infeasible "E054" "bounds and constraints contradict each other"
        "No values of the free parameters meet all of those that are named; without any one of them the others can be met. Of constraints that are no straight lines this is judged where the search stood still. Correct one of them, free a parameter, or start elsewhere."
    CutShort "E060" "the data end in the middle of a row"
        "What was piped in stopped within a row: the line has no end, so its last number may have lost digits. The rows before it are whole; `--save` has written them into a state, from which `--resume` goes on. A program that writes rows should end each with its line, and the last one too."
    BadState "E061" "the saved state does not fit"
        "A state of `--save` belongs to one model, one kind of weights and one choice of free parameters, and this is another, or the file is no state at all. Go on with the model it was made from and the same `--fix`, `--free`, `--weights` and `--loss`, or begin anew from the data."
    DifferentPoints "E062" "states cannot be merged"
        "What is left of rows that were not kept holds where they were linearised, and these states have absorbed rows at different points. Make all parts with `--hold-point` from one `--start`, or keep their rows (`--keep all`), which are then linearised together."
    TooLong "E063" "a file or a line is too long"
        "A model has at most 4 MiB, any other text that is read as a whole (a fit, a state, a matrix) 256 MiB, and a row of data 16 MiB, so that a wrong file, such as a device or a picture, or a quote that is never closed, does not fill the memory. Rows of data may be as many as there are: what belongs to single rows goes into a table, not into the model."
    NothingToVary "E070" "no parameter can be started elsewhere"
        "`--starts` draws starting values between `min` and `max`, or by the prior that `sigma` declares, and no free parameter has either. Say where the truth may be: `Free(nominal: 1, min: 0, max: 2)`."
    StartProjected "W001" "the start was moved into the bounds"
        "A starting value lay outside `min` and `max` and was moved to the nearest of them, from where the search begins. Correct the start file or the bounds."
    UnitWeights "W002" "weights are unit although inputs carry sigmas"
        "All residuals count alike and what is declared about the sensors is not used; uncertainties are judged by the residuals themselves. Ask for weights explicitly to be rid of the warning."
    OptionalAbsent "W003" "an optional data file is absent"
        "The file says `optional: true` and is not there; the rest is used."
    ConstantResidual "W004" "a residual does not depend on any free parameter"
        "It adds to the cost but determines nothing. It may be a check, or a name in it is not the one meant; outputs are the place for what is only to be printed."
    Underdetermined "W005" "there are more unknowns than equations"
        "The data cannot determine all free parameters, whatever their quality. Measure more rows, hold parameters, or give priors by `sigma`."
    NotEstimable "W006" "a parameter is not estimable"
        "A combination of parameters changes no residual, so no sigma is given for those in it. Hold one of them as a datum, with `--fix` or `Held(…)`, or measure what tells them apart."
    PracticallyWeak "W007" "the data see a combination only weakly"
        "The data determine a combination of parameters worse than the declared tolerance. More rows, other places, or a prior from the maker's tolerance help; nothing is wrong with the estimate but its width."
    DatasetAbsent "W008" "a measurement has no data"
        "Neither the model nor `--data` names a file for it that is there; the other measurements are used."
    SigmasUnused "W009" "declared sigmas are not used"
        "Some residuals declare a sigma and others do not, so they cannot be weighed against each other, and all count alike. Give the named residual a sigma: `\"r\": (value: \"…\", sigma: \"0.1 mm\")`, or say `--weights unit`."
    LargeAngle "W010" "an angle is larger than any angle"
        "A number without a unit stands for more than a turn, or a column reads more than two turns: `alpha: 90` in a model whose angles are in radians is 90 rad. Write `\"90 deg\"`, or declare the column's unit."
    UnusedMember "W011" "a member of a family is in no row"
        "The model states a value for a member that no row of data names, so it takes no part. Names are compared as they stand: `a` is not `A`."
    RedundantEquations "W013" "equations of a row say the same"
        "Under propagated weights, the errors of a row's readings leave a combination of its equations without error, so that it holds or fails whatever was measured: two equations that say the same, or a sum of others. It is left out, and the degrees of freedom count what remains. Remove the equation that says nothing new."
    HeldOutside "W014" "a parameter is held outside its bounds"
        "`--fix NAME=VALUE` or a start file holds a parameter at a value that its `min` or `max` forbids. Bounds are those of a search, so the value stays as it is. Correct the value or the bounds."
    RowsInMemory "W012" "rows are kept in memory"
        "Rows of large files wait in a temporary file, and none can be written: its directory is missing or full. The result is the same, but memory grows with the rows. Make room, or name another directory by the environment variable `TMPDIR`."
    BetterElsewhere "W030" "another start leads to a better minimum"
        "From the declared values the search ends in a minimum that is not the best one found, which is what is reported. Declare nominal values nearer to it, or narrow the bounds if it makes no sense."
    Ambiguous "W031" "several minima are as good"
        "Different values of the parameters explain the data as well, by χ² or but for rounding, such as a mirrored geometry: the data alone do not tell which is true. Narrow the bounds so that one remains, give a prior, or measure what tells them apart."
    NotFollowed "W032" "the continuation did not reach the end"
        "Between readings that the start explains and those that were made the path turned back, ended, or met something undefined. The result is that of a search from the start alone. Start nearer, or declare bounds and ask for `--starts`."
    Interrupted "W050" "the run was interrupted"
        "Somebody pressed Ctrl-C, or asked the program to end. What was done so far is reported and written, whole files only, and it is not to be trusted: a search was cut short, or not all runs were made. A second Ctrl-C ends the program at once. A fit goes on with `--start FIT.json`."
    WhichFormat "E071" "the format of a file cannot be told"
        "The columns of a Denavit-Hartenberg table and of a modified one are the same, and other products are meant; a file without ending says nothing either. Say which it is: `phical import arm.csv --as mdh`. Tables that phical exports say it in their first cell, `joint [mdh]`."
    BadUrdf "E072" "the file is not a URDF"
        "It is not XML, or lacks what a robot has: joints with a name, a type, a parent and a child, three numbers for `xyz` and `rpy`, an axis with a direction. Files in xacro have to be expanded first: `xacro robot.urdf.xacro > robot.urdf`."
    NotOneChain "E073" "the links are not one chain"
        "A chain goes from one link to another along the joints between them. Where the robot has several ends (a flange, two fingers) say which is meant: `phical import robot.urdf --to tool0`, and `--from` for a first link other than the root. To write a chain back the links are `--base` and `--tip`."
    UnsupportedJoint "E074" "a joint moves in several ways at once"
        "Joints of type `planar` and `floating` have two and six readings; those of a chain have one. End the chain beside it with `--from` or `--to`, or write two prismatic joints, or three and three revolute ones, in its place."
    NothingMoves "E075" "no joint moves"
        "A chain without readings is a constant. Of a table, rows read an angle unless the column `reads` says `length` or `nothing`; of a URDF, the joints between the two links are all fixed."
    UnknownChain "E076" "there is no such chain or joint"
        "`--chain` names a chain that the model has not, or several are there and none is named; `--after` names a joint of the chain. The hint lists them."
    OtherRobot "E077" "the chain is not the one of the URDF"
        "Calibrated numbers go into the URDF joint by joint, so the chain has as many joints that turn and slide, in the same order, as there are between the two links. Name the links that the chain was imported between: `--base LINK --tip LINK`."
    EmptyScenario "E080" "a scenario has no rows"
        "What would be seen cannot be said of nothing: the scenario has no measurements, or none with rows. Give its measurements `rows: 100`, or `--rows MEASUREMENT=NUMBER`."
    NoConsistentInputs "E081" "no inputs are consistent with the parameters"
        "What a model can see is judged where its residuals vanish, and no row can be moved there: its residuals contradict each other, or depend on no input that may be moved (where some inputs have a sigma, those without one are exact). Declare a scenario that solves for the inputs, or give sigmas to the inputs that are measured."
    BadDatum "E082" "these parameters are no datum"
        "A datum takes up the directions that the data do not see: one parameter for each, which together move along all of them. `phical identify MODEL` lists the choices, under the heading of what to hold."
    TooManyRows "E083" "more rows are wanted than there are candidates"
        "A design picks each candidate once at most, and at least one. Ask for fewer rows with `--pick`, draw more candidates from the scenario with `--rows MEASUREMENT=NUMBER`, or give a longer file with `--candidates MEASUREMENT=FILE`."
    TargetUnseen "E084" "no candidate sees what the design is for"
        "The target, or for `--criterion` some parameter, changes along a direction in which no candidate changes, so that no choice of rows makes it known. The message names the direction. Hold one of its parameters as a datum, add candidates of another kind, or choose a target that does not depend on it, such as a distance instead of a place."
    BadRequirement "E085" "the required uncertainty makes no sense"
        "`--require EXPR=U` states a standard uncertainty, which is positive and has the unit of the expression: `--require \"norm(p1 - p2)=0.05 mm\"`. It needs sigmas of the inputs or of the residuals: without them nothing tells how large errors are."
    TooFewRows "E086" "so few rows leave something undetermined"
        "Any choice of so many candidates, together with the priors, has fewer equations than unknowns or misses a direction that all candidates together see. Pick more rows, hold parameters with `--fix`, or state priors by `sigma`."
    TargetNowhere "E087" "no row of the volume has the target"
        "A target is an output of a measurement, or an expression of its inputs and definitions, and the volume has rows of other measurements only. Name rows that have it with `--over`: a scenario, or `MEASUREMENT=FILE`."
    BadMatrix "E090" "the matrix does not fit"
        "An audited Jacobian has for each row of data one row for each residual, in declared order, and a column for each free parameter; named columns may stand in any order and need not be all. The message says what was read and what is there: `--free`, `--fix` and `--data` choose the same parameters and rows that the other program had."
    NearConvention "W040" "a joint is close to where its convention breaks down"
        "A phi-model joint states the next axis by its common normal with the z of the phi-frame, a Denavit-Hartenberg row by that with its own axis. Where the two are parallel there is none: two parameters do the same, and a tilt cannot be stated. Write the joint with the phi of the hint, which puts the z of the phi-frame across the axis; the numbers beside it state the same nominal geometry."
    NearlyParallel "W041" "a table has huge numbers"
        "Two axes are nearly parallel, so their common normal, which a Denavit-Hartenberg row is about, is far away: a tilt of 2 µrad moves it by hundreds of metres, and digits of the pose are lost. It is right all the same. Hayati's form with a `beta` column has no such numbers: leave out `--plain`."
    NoUncertainty "W042" "exported numbers have no uncertainty"
        "An exported number depends on a combination of parameters that the fit does not determine or that a bound holds, or the format has no number for what is uncertain (the tilt of axes that are parallel, in a table without `beta`). The values are as good as the fit; the covariance is not complete."
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_row_is_complete_and_unique() {
        let ids: BTreeSet<_> = Code::ALL.iter().map(|code| code.id()).collect();
        assert_eq!(ids.len(), Code::ALL.len());
        for &code in Code::ALL {
            assert!(code.id().len() == 4 && code.id().starts_with(['E', 'W']));
            assert!(!code.title().is_empty() && !code.title().ends_with('.'));
            assert!(code.explanation().len() > 60 && code.explanation().ends_with('.'));
            assert_eq!(Code::from_id(&code.id().to_lowercase()), Some(code));
        }
        assert_eq!(Code::from_id("E999"), None);
        assert_eq!(Code::UnknownVariant.to_string(), "E006");
    }
}
