//! Tables of texts and their trees, and of mistakes and their errors.

use super::ParseErrorKind::*;
use super::*;

type Sign = super::relation::Comparison;
const COMPARED: ParseErrorKind = ParseErrorKind::Comparison;

/// The tree in prefix form.
fn lisp(expr: &Expr) -> String {
    let list = |head: &str| expr.children().fold(head.to_owned(), |text, child| text + " " + &lisp(child));
    match &expr.kind {
        ExprKind::Number { value, unit: None } => format!("{value}"),
        ExprKind::Number { value, unit: Some((symbol, _)) } => format!("{value}_{symbol}"),
        ExprKind::Name(name) => name.clone(),
        ExprKind::Field(_, field) => format!("({} {field})", list(".")),
        ExprKind::Index { family, keys } => {
            format!("[{family}{}]", keys.iter().map(|key| format!(" {}", key.name)).collect::<String>())
        }
        ExprKind::Call { function, .. } => format!("({})", list(function)),
        ExprKind::Negate(_) => format!("({})", list("neg")),
        ExprKind::Binary { op, .. } => format!("({})", list(op.symbol())),
    }
}

#[test]
fn trees() {
    for (text, tree) in [
        ("a - b - c", "(- (- a b) c)"),
        ("a - (b - c)", "(- a (- b c))"),
        ("a + b*c/d", "(+ a (/ (* b c) d))"),
        ("-x^2", "(neg (^ x 2))"),
        ("-a*b", "(* (neg a) b)"),
        ("a*-b+c", "(+ (* a (neg b)) c)"),
        ("a - -b", "(- a (neg b))"),
        ("2^-1", "(^ 2 (neg 1))"),
        ("2^-x^y*z", "(* (^ 2 (neg (^ x y))) z)"),
        ("a^b^c", "(^ a (^ b c))"),
        ("a·b×c − d", "(- (* (* a b) c) d)"),
        ("L1.alpha", "(. L1 alpha)"),
        ("left(hzL1, vL1).o.x", "(. (. (left hzL1 vL1) o) x)"),
        ("(a + b).x^2", "(^ (. (+ a b) x) 2)"),
        ("socket[place, hole].x", "(. [socket place hole] x)"),
        ("base()", "(base)"),
        ("f(a + b, -c)", "(f (+ a b) (neg c))"),
        ("θ_1 + ψ", "(+ θ_1 ψ)"),
        ("  ((x))\n", "x"),
        ("1e-3 + .5 + 2. + 1.5E+2", "(+ (+ (+ 0.001 0.5) 2) 150)"),
        ("1e−3", "0.001"),
        ("17.59 arcsec", "17.59_arcsec"),
        ("5mm/s", "5_mm/s"),
        ("9.8 m/s^2*x", "(* 9.8_m/s^2 x)"),
        ("2 mm/x", "(/ 2_mm x)"),
        ("2 mm / s", "(/ 2_mm s)"),
        ("2 m*s", "2_m*s"),
        ("2 m*s(x)", "(* 2_m (s x))"),
        ("2*m", "(* 2 m)"),
        ("1/s", "(/ 1 s)"),
        ("5 min", "5_min"),
        ("5 % + 3ppm", "(+ 5_% 3_ppm)"),
        ("5 m^n", "(^ 5_m n)"),
        ("5 m^2^3", "(^ 5_m^2 3)"),
        ("90°", "90_°"),
        ("-12°30'", "(neg 12.5_°)"),
        ("12°30'36\"/2", "(/ 12.51_° 2)"),
        ("30' + 15\"", "(+ 30_' 15_\")"),
        ("3 µm - 3 μm", "(- 3_µm 3_μm)"),
        ("2*pi/3 + 1 deg", "(+ (/ (* 2 pi) 3) 1_deg)"),
    ] {
        assert_eq!(parse(text).map(|expr| lisp(&expr)).as_deref(), Ok(tree), "{text}");
    }
}

#[test]
fn spans() {
    let text = " (f(α, -b) ) . x * s[k,  lm]";
    let expr = parse(text).unwrap();
    let mut parts = Vec::new();
    expr.visit(|expr| parts.push(&text[expr.span.clone()]));
    assert_eq!(parts, ["(f(α, -b) ) . x * s[k,  lm]", "(f(α, -b) ) . x", "f(α, -b)", "α", "-b", "b", "s[k,  lm]"]);
    expr.visit(|expr| match &expr.kind {
        ExprKind::Call { function, name_span, .. } => assert_eq!(&text[name_span.clone()], function),
        ExprKind::Field(_, field) => assert!(text[expr.span.clone()].ends_with(field)),
        ExprKind::Index { keys, .. } => keys.iter().for_each(|key| assert_eq!(text[key.span.clone()], key.name)),
        _ => (),
    });
}

#[test]
fn mistakes() {
    // The text with the place of the mistake between ‹ and ›, its kind, and a word of message or hint.
    for (marked, kind, word) in [
        ("‹›", Empty, "no expression"),
        ("‹ \t›", Empty, "no expression"),
        ("a ‹$› b", UnexpectedCharacter, "`$`"),
        ("a ‹%› b", UnexpectedCharacter, "wrap"),
        ("x‹²›", UnexpectedCharacter, "`^2`"),
        ("a ‹–› b", UnexpectedCharacter, "minus"),
        ("‹µ›", UnexpectedCharacter, "micro sign"),
        ("‹\u{0}›", UnexpectedCharacter, "\\0"),
        ("‹[›1, 2]", UnexpectedCharacter, "vec(x, y, z)"),
        ("2*‹(›a + b", UnclosedBracket, "not closed"),
        ("f‹(›a, b", UnclosedBracket, "not closed"),
        ("s‹[›a", UnclosedBracket, "`[`"),
        ("((a)*‹(›", UnclosedBracket, "not closed"),
        ("‹(›a]", UnclosedBracket, "`]` stands where"),
        ("a‹)› + b", UnopenedBracket, "closes nothing"),
        ("‹)›", UnopenedBracket, "closes nothing"),
        ("a ‹+›", MissingOperand, "after `+`"),
        ("(a ‹*›)", MissingOperand, "after `*`"),
        ("‹*› a", MissingOperand, "in front of `*`"),
        ("‹+›5", MissingOperand, "needs no `+`"),
        ("a ‹*› / b", MissingOperand, "after `*`"),
        ("‹()›", MissingOperand, "nothing between"),
        ("f(a‹,›)", MissingOperand, "after `,`"),
        ("f(‹,›a)", MissingOperand, "in front of `,`"),
        ("‹.›x", MissingOperand, "in front of `.`"),
        ("‹-›", MissingOperand, "after `-`"),
        ("a ‹b›", MissingOperator, "written `*`"),
        ("2 ‹(›x)", MissingOperator, "written `*`"),
        ("2 m‹(›x)", MissingOperator, "written `*`"),
        ("(a)‹(›b)", MissingOperator, "written `*`"),
        ("5 m ‹s›", MissingOperator, "no spaces inside"),
        ("v‹.5›", MissingOperator, "no operator"),
        ("f(a ‹b›)", MissingOperator, "no operator"),
        ("0‹,›5", TrailingText, "decimals follow a point"),
        ("(a‹,› b)", TrailingText, "not between arguments"),
        ("a‹.›", ExpectedName, "component"),
        ("a.‹(›b)", ExpectedName, "component"),
        ("s[‹0›]", ExpectedName, "key column"),
        ("s[‹]›", ExpectedName, "key column"),
        ("s[a, ‹]›", ExpectedName, "follow the comma"),
        ("‹f(x).dot›(b)", NotCallable, "`dot(…)`"),
        ("‹f(x)›(y)", NotCallable, "by its name"),
        ("f(x)‹[›k]", NotIndexable, "family"),
        ("‹1e999›", BadNumber, "too large"),
        ("1 + ‹1e308 km›", BadNumber, "too large"),
        ("‹1e-999›", BadNumber, "too small"),
        ("‹1e+›", BadNumber, "no digits"),
        ("‹1e›", BadNumber, "no digits"),
        ("‹1.2.›3", BadNumber, "a point too many"),
        ("‹1..›2", BadNumber, "a point too many"),
        ("‹1_›000", BadNumber, "not grouped"),
        ("‹12°60'›", BadNumber, "not below 60"),
        ("‹12°30›", BadNumber, "`12°34'56.7\"`"),
        ("‹12.5°30'›", BadNumber, "decimals"),
        ("2 ‹mmm›", UnknownUnit, "did you mean `2 mm`"),
        ("2‹x›", UnknownUnit, "`2*x`"),
        ("20 ‹°C›", UnknownUnit, "not a unit"),
        ("2 ‹m^1.7› + x", UnknownUnit, "multiples of a half"),
        ("a ‹<› b", COMPARED, "comparison-free"),
        ("a ‹<=› b", COMPARED, "comparison-free"),
        ("a ‹==› b", COMPARED, "comparison-free"),
        ("a ‹=› b", Assignment, "define"),
        ("a‹**›2", DoubleStar, "`^`"),
    ] {
        let start = marked.find('‹').unwrap();
        let text = marked.replace(['‹', '›'], "");
        let end = marked.find('›').unwrap() - '‹'.len_utf8();
        let error = parse(&text).expect_err(&text);
        assert_eq!((error.kind, error.span.clone()), (kind, start..end), "{text}: {error}");
        let said = format!("{} / {}", error.message, error.hint.unwrap_or_default());
        assert!(said.contains(word), "{text}: {said}");
        assert!(!error.message.ends_with('.'), "{text}: {said}");
    }
}

#[test]
fn relations() {
    for (text, comparison, sides) in [
        ("a = b", Sign::Equal, &["a", "b"][..]),
        ("a <= b + 1", Sign::AtMost, &["a", "(+ b 1)"]),
        ("a≥b", Sign::AtLeast, &["a", "b"]),
        ("0.1 mm <= a <= 3mm", Sign::AtMost, &["0.1_mm", "a", "3_mm"]),
        ("3 >= -a >= 1", Sign::AtLeast, &["3", "(neg a)", "1"]),
        ("s['front/0'].z = s[b, 'it''s']", Sign::Equal, &["(. [s front/0] z)", "[s b it's]"]),
        ("s['a<=b'] = 12°30'", Sign::Equal, &["[s a<=b]", "12.5_°"]),
    ] {
        let relation = parse_relation(text).unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!(relation.comparison, comparison, "{text}");
        assert_eq!(relation.sides.iter().map(lisp).collect::<Vec<_>>(), sides, "{text}");
    }
}

#[test]
fn mistakes_of_relations_have_a_place() {
    for (marked, kind, word) in [
        ("‹›", Empty, "a <= b"),
        ("‹a + b›", MissingOperator, "a <= b"),
        ("a ‹==› b", COMPARED, "write `=`"),
        ("a ‹<› b", COMPARED, "write `<=`"),
        ("a ‹>› b", COMPARED, "write `>=`"),
        ("a ‹=>› b", COMPARED, "write `>=`"),
        ("a ‹!=› b", COMPARED, "restricts nothing"),
        ("a = b ‹=› c", COMPARED, "two constraints"),
        ("a = b ‹<=› c", COMPARED, "two constraints"),
        ("a <= b ‹>=› c", COMPARED, "same way"),
        ("a <= b <= c ‹<=› d", COMPARED, "two ends"),
        ("(a ‹=› b) + c", COMPARED, "brackets"),
        ("f(a ‹<=› b)", COMPARED, "brackets"),
        ("‹=› b", MissingOperand, "in front of `=`"),
        ("a ‹<=›", MissingOperand, "after `<=`"),
        ("a = b ‹c›", MissingOperator, "in front of `c`"),
        ("s[‹'›a] = b", UnexpectedCharacter, "does not end"),
        ("‹'a'› = b", UnexpectedCharacter, "member"),
        ("s[‹1›] = b", ExpectedName, "`'1'`"),
    ] {
        let start = marked.find('‹').unwrap();
        let text = marked.replace(['‹', '›'], "");
        let end = marked.find('›').unwrap() - '‹'.len_utf8();
        let error = parse_relation(&text).expect_err(&text);
        assert_eq!((error.kind, error.span.clone()), (kind, start..end), "{text}: {error}");
        let said = format!("{} / {}", error.message, error.hint.unwrap_or_default());
        assert!(said.contains(word), "{text}: {said}");
    }
}

#[test]
fn deep_texts_are_refused_at_once() {
    let many = 100_000;
    let deep = [
        "(".repeat(many),
        "f(".repeat(many),
        "-".repeat(many),
        "a^".repeat(many),
        "-f(".repeat(many),
        "a^(".repeat(many),
        "a + ".repeat(many) + "a",
        "a".to_owned() + &".x".repeat(many),
    ];
    for text in &deep {
        let error = parse(text).unwrap_err();
        assert_eq!(error.kind, TooDeep, "{}", &text[..4]);
        assert!(error.span.end < 1000, "{}", &text[..4]);
    }
    let fits = "a + ".repeat(MAX_DEPTH - 1) + "a";
    assert_eq!(print(&parse(&fits).unwrap()), fits);
    assert!(parse(&format!("{}a{}", "(".repeat(MAX_DEPTH), ")".repeat(MAX_DEPTH))).is_ok());
    assert!(parse(&format!("f({}a)", "a, ".repeat(many))).is_ok());
}

#[test]
fn signatures() {
    let read = |text: &str| parse_signature(text).map(|head| (head.name.name, head.parameters.len()));
    assert_eq!(read("sight_length(l, r)"), Ok(("sight_length".to_owned(), 2)));
    assert_eq!(read(" f ( ) "), Ok(("f".to_owned(), 0)));
    for (text, kind, span) in [
        ("", Empty, 0..0),
        ("(a)", ExpectedName, 0..1),
        ("f", MissingOperand, 0..1),
        ("f + 1", MissingOperand, 2..3),
        ("f(", UnclosedBracket, 1..2),
        ("f(a", UnclosedBracket, 1..2),
        ("f(a,)", ExpectedName, 4..5),
        ("f(,a)", ExpectedName, 2..3),
        ("f(a,,b)", ExpectedName, 4..5),
        ("f(a b)", MissingOperator, 4..5),
        ("f(2)", ExpectedName, 2..3),
        ("f(a.b)", MissingOperator, 3..4),
        ("f(a) = 2", Assignment, 5..6),
        ("f(a) b", TrailingText, 5..6),
        ("f(a, b, a)", DuplicateParameter, 8..9),
    ] {
        let error = parse_signature(text).expect_err(text);
        assert_eq!((error.kind, error.span.clone()), (kind, span), "{text}: {error}");
    }
}

#[test]
fn fewest_brackets() {
    for text in [
        "a - (b - c)",
        "a / (b * c)",
        "-x^2",
        "(-x)^2",
        "(a^b)^c",
        "a^b^c",
        "a^-b",
        "a^(b + c)",
        "-(a * b)",
        "-a * b",
        "a * -b",
        "--a",
        "(2 mm)^2",
        "(2).x",
        "2^3",
        "(a + b).x",
        "2 mm / s",
        "1e-7 m + 1e300",
        "f(a + b, socket[k, l].x)",
    ] {
        assert_eq!(print(&parse(text).unwrap()), text);
    }
}

#[test]
fn negative_numbers_print_as_negations() {
    let number = |value| Expr { kind: ExprKind::Number { value, unit: None }, span: 0..0 };
    let power = ExprKind::Binary { op: Op::Pow, left: Box::new(number(-2.0)), right: Box::new(number(-0.5)) };
    assert_eq!(print(&Expr { kind: power, span: 0..0 }), "(-2)^-0.5");
}
