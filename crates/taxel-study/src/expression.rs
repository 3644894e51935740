//! Expressions of links, constraints and objectives: numbers with units, names, `+ - * / ^`,
//! parentheses and a few functions. Dimensions are checked when they are read.

use std::ops::Range;

use taxel::quantity;
use taxel::words::advice;

use crate::exponents::{Exponents, NONE};

/// A mistake in an expression, at a byte range of its text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mistake {
    /// The words at fault.
    pub span: Range<usize>,
    /// Description.
    pub message: String,
    /// Advice.
    pub help: String,
}

/// An expression, read and checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    steps: Vec<Step>,
    /// Its dimension.
    pub exponents: Exponents,
}

/// `left <= right`.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// What must be the smaller one.
    pub less: Expression,
    /// What must be the greater one.
    pub greater: Expression,
}

/// A step of the evaluation, which takes values from a stack and puts one there: a chain of 20 000
/// factors is as deep as one of two.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Step {
    Number(f64),
    Name(usize),
    Negative,
    Binary(Operator),
    /// With so many arguments.
    Call(Function, usize),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Operator {
    Plus,
    Minus,
    Times,
    Over,
    Power,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Function {
    /// Of one value or more, as [`Function::Max`].
    Min,
    Max,
    Sqrt,
    Abs,
    Ln,
    Exp,
}

const FUNCTIONS: [(&str, Function); 6] = [
    ("min", Function::Min),
    ("max", Function::Max),
    ("sqrt", Function::Sqrt),
    ("abs", Function::Abs),
    ("ln", Function::Ln),
    ("exp", Function::Exp),
];

/// Deepest nesting: a guard of the stack.
const DEEPEST: usize = 64;

/// Names with their dimensions, in the order of the values of [`Expression::value`].
pub type Names<'a> = &'a [(String, Exponents)];

/// Reads an expression over `names`.
///
/// # Errors
/// The first mistake.
///
/// # Example
/// ```
/// use taxel_study::exponents::Exponents;
/// use taxel_study::expression::expression;
/// let length = Exponents::of(&taxel::quantity::LENGTH);
/// let names = [(String::from("thickness"), length)];
/// let rest = expression("thickness - 200 um", &names).unwrap();
/// assert!((rest.value(&[950e-6]) - 750e-6).abs() < 1e-18);
/// let mistake = expression("thickness - 200 kPa", &names).unwrap_err();
/// assert_eq!(&"thickness - 200 kPa"[mistake.span], "200 kPa");
/// ```
pub fn expression(text: &str, names: Names<'_>) -> Result<Expression, Mistake> {
    let mut reader = Reader::new(text, names)?;
    let (steps, exponents, _) = reader.sum()?;
    reader.end("the end of the expression")?;
    Ok(Expression { steps, exponents })
}

/// Reads a comparison `a <= b` or `a >= b` over `names`.
///
/// # Errors
/// The first mistake.
pub fn comparison(text: &str, names: Names<'_>) -> Result<Comparison, Mistake> {
    let mut reader = Reader::new(text, names)?;
    let (left, of_left, _) = reader.sum()?;
    let at_most = match reader.token() {
        Some(Token::Compare(at_most)) => *at_most,
        _ => return Err(reader.mistake("<= or >= is needed here", "write such as range >= 100 N")),
    };
    reader.at += 1;
    let (right, of_right, span) = reader.sum()?;
    reader.end("the end of the comparison")?;
    if of_left != of_right {
        return Err(Mistake {
            span,
            message: format!(
                "this is {}; {} is compared with it",
                of_right.name(),
                of_left.name()
            ),
            help: String::from("compare what has the same dimension"),
        });
    }
    let left = Expression {
        steps: left,
        exponents: of_left,
    };
    let right = Expression {
        steps: right,
        exponents: of_right,
    };
    let (less, greater) = if at_most {
        (left, right)
    } else {
        (right, left)
    };
    Ok(Comparison { less, greater })
}

/// Names that an expression uses, as they stand in its text; no check of them.
///
/// # Errors
/// A character that no expression has.
pub fn names_in(text: &str) -> Result<Vec<(String, Range<usize>)>, Mistake> {
    let tokens = tokens(text)?;
    let mut found = Vec::new();
    for (at, (token, span)) in tokens.iter().enumerate() {
        let called = matches!(tokens.get(at + 1), Some((Token::Sign('('), _)));
        if let Token::Name(name) = token
            && !called
        {
            found.push((name.clone(), span.clone()));
        }
    }
    Ok(found)
}

impl Expression {
    /// Value for the `values` of its names, SI.
    pub fn value(&self, values: &[f64]) -> f64 {
        value_of(&self.steps, values)
    }

    /// Index of the only name, if the expression is one.
    pub fn lone_name(&self) -> Option<usize> {
        match self.steps[..] {
            [Step::Name(index)] => Some(index),
            _ => None,
        }
    }
}

impl Comparison {
    /// How far it is from holding, as a share of the greater of both sides: zero or less where
    /// it holds; not a number where a value is none.
    pub fn excess(&self, values: &[f64]) -> f64 {
        let (less, greater) = (self.less.value(values), self.greater.value(values));
        let size = less.abs().max(greater.abs());
        if size > 0.0 {
            (less - greater) / size
        } else {
            less - greater
        }
    }
}

/// Value of steps that give one.
fn value_of(steps: &[Step], values: &[f64]) -> f64 {
    let mut stack: Vec<f64> = Vec::new();
    for step in steps {
        let value = match step {
            Step::Number(number) => *number,
            Step::Name(index) => values[*index],
            Step::Negative => -taken(&mut stack),
            Step::Binary(operator) => {
                let b = taken(&mut stack);
                let a = taken(&mut stack);
                match operator {
                    Operator::Plus => a + b,
                    Operator::Minus => a - b,
                    Operator::Times => a * b,
                    Operator::Over => a / b,
                    Operator::Power => a.powf(b),
                }
            }
            Step::Call(function, count) => {
                let a = taken(&mut stack);
                // What is not a number stays so.
                let of_all = |of_two: fn(f64, f64) -> f64, stack: &mut Vec<f64>| {
                    (1..*count).fold(a, |a, _| {
                        let b = taken(stack);
                        if a.is_nan() || b.is_nan() {
                            f64::NAN
                        } else {
                            of_two(a, b)
                        }
                    })
                };
                match function {
                    Function::Min => of_all(f64::min, &mut stack),
                    Function::Max => of_all(f64::max, &mut stack),
                    Function::Sqrt => a.sqrt(),
                    Function::Abs => a.abs(),
                    Function::Ln => a.ln(),
                    Function::Exp => a.exp(),
                }
            }
        };
        stack.push(value);
    }
    taken(&mut stack)
}

/// The last value of the stack: the reader puts one there for each that a step takes.
fn taken(stack: &mut Vec<f64>) -> f64 {
    stack.pop().unwrap_or(f64::NAN)
}

#[derive(Debug, Clone, PartialEq)]
enum Token {
    Number(f64, Exponents),
    Name(String),
    Sign(char),
    /// True for `<=`.
    Compare(bool),
}

/// The longest unit at the start of `text`.
fn unit_at(text: &str) -> Option<(&'static quantity::Dimension, &'static str)> {
    let lengths = quantity::dimensions().flat_map(|dimension| dimension.units.iter());
    let longest = lengths
        .map(|(unit, _)| unit.chars().count())
        .max()
        .unwrap_or(0);
    // What may be a unit, and the character behind it.
    let micro = |c: char| if matches!(c, 'µ' | 'μ') { 'u' } else { c };
    let plain: String = text.chars().take(longest + 1).map(micro).collect();
    quantity::dimensions()
        .flat_map(|dimension| {
            dimension
                .units
                .iter()
                .map(move |(unit, _)| (dimension, *unit))
        })
        .filter(|(_, unit)| {
            plain
                .strip_prefix(*unit)
                .is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_'))
        })
        .max_by_key(|(_, unit)| unit.len())
}

fn tokens(text: &str) -> Result<Vec<(Token, Range<usize>)>, Mistake> {
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        let rest = &text[at..];
        if c.is_whitespace() {
            at += c.len_utf8();
        } else if c.is_ascii_digit() || c == '.' {
            let (token, length) = number(rest, at)?;
            found.push((token, at..at + length));
            at += length;
        } else if c.is_alphabetic() || c == '_' {
            let end = rest
                .find(|c: char| !(c.is_alphanumeric() || matches!(c, '_' | '.' | '[' | ']')))
                .unwrap_or(rest.len());
            found.push((Token::Name(rest[..end].to_owned()), at..at + end));
            at += end;
        } else if rest.starts_with("<=") || rest.starts_with(">=") {
            found.push((Token::Compare(c == '<'), at..at + 2));
            at += 2;
        } else if "+-*/^(),".contains(c) {
            found.push((Token::Sign(c), at..at + 1));
            at += 1;
        } else {
            return Err(Mistake {
                span: at..at + c.len_utf8(),
                message: format!("\"{c}\" has no meaning in an expression"),
                help: String::from("use numbers with units, names, + - * / ^ ( ) , <= >="),
            });
        }
    }
    Ok(found)
}

/// The number at the start of `text` with its unit, and its length.
fn number(text: &str, at: usize) -> Result<(Token, usize), Mistake> {
    let bytes = text.as_bytes();
    let mut end = 0;
    while end < bytes.len() {
        let exponent = matches!(bytes[end], b'e' | b'E')
            && bytes.get(end + 1).is_some_and(|next| {
                next.is_ascii_digit()
                    || (matches!(next, b'+' | b'-')
                        && bytes.get(end + 2).is_some_and(u8::is_ascii_digit))
            });
        let sign =
            matches!(bytes[end], b'+' | b'-') && end > 0 && matches!(bytes[end - 1], b'e' | b'E');
        if !(bytes[end].is_ascii_digit() || bytes[end] == b'.' || exponent || sign) {
            break;
        }
        end += 1;
    }
    let wrong = || Mistake {
        span: at..at + end,
        message: format!("\"{}\" is not a number", &text[..end]),
        help: String::from("write numbers with a decimal point, such as 1.5"),
    };
    let value: f64 = text[..end].parse().map_err(|_| wrong())?;
    let behind = &text[end..];
    let gap = behind.len() - behind.trim_start().len();
    if let Some((dimension, unit)) = unit_at(behind.trim_start()) {
        // A micro sign may take more bytes than the `u` that it means.
        let written = behind[gap..].chars().take(unit.chars().count());
        let length = end + gap + written.map(char::len_utf8).sum::<usize>();
        let value = dimension
            .parse(&format!("{} {unit}", &text[..end]))
            .map_err(|_| wrong())?;
        return Ok((Token::Number(value, Exponents::of(dimension)), length));
    }
    if behind.trim_start().starts_with('%') {
        return Ok((Token::Number(value / 100.0, NONE), end + gap + 1));
    }
    if value.is_finite() {
        Ok((Token::Number(value, NONE), end))
    } else {
        Err(wrong())
    }
}

struct Reader<'a> {
    text: &'a str,
    tokens: Vec<(Token, Range<usize>)>,
    names: Names<'a>,
    at: usize,
    depth: usize,
}

type Part = (Vec<Step>, Exponents, Range<usize>);

impl<'a> Reader<'a> {
    fn new(text: &'a str, names: Names<'a>) -> Result<Self, Mistake> {
        Ok(Self {
            text,
            tokens: tokens(text)?,
            names,
            at: 0,
            depth: 0,
        })
    }

    fn token(&self) -> Option<&Token> {
        self.tokens.get(self.at).map(|(token, _)| token)
    }

    fn span(&self) -> Range<usize> {
        let end = self.text.len();
        let span = self.tokens.get(self.at).map(|(_, span)| span.clone());
        span.unwrap_or(end.saturating_sub(1)..end)
    }

    fn mistake(&self, message: impl Into<String>, help: &str) -> Mistake {
        Mistake {
            span: self.span(),
            message: message.into(),
            help: help.to_owned(),
        }
    }

    fn takes(&mut self, sign: char) -> bool {
        let there = self.token() == Some(&Token::Sign(sign));
        self.at += usize::from(there);
        there
    }

    fn end(&self, what: &str) -> Result<(), Mistake> {
        if self.at < self.tokens.len() {
            let message = format!("{what} is needed here");
            return Err(self.mistake(message, "put an operator between two values"));
        }
        Ok(())
    }

    fn sum(&mut self) -> Result<Part, Mistake> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(self.mistake("the parentheses are nested too deeply", "write it shorter"));
        }
        let (mut steps, exponents, mut span) = self.product()?;
        loop {
            let operator = if self.takes('+') {
                Operator::Plus
            } else if self.takes('-') {
                Operator::Minus
            } else {
                self.depth -= 1;
                return Ok((steps, exponents, span));
            };
            let (right, of_right, right_span) = self.product()?;
            if of_right != exponents {
                return Err(Mistake {
                    message: format!(
                        "this is {}; {} is needed here",
                        of_right.name(),
                        exponents.name()
                    ),
                    help: String::from("add and subtract what has the same dimension"),
                    span: right_span,
                });
            }
            span = span.start..right_span.end;
            steps.extend(right);
            steps.push(Step::Binary(operator));
        }
    }

    fn product(&mut self) -> Result<Part, Mistake> {
        let (mut steps, mut exponents, mut span) = self.signed()?;
        loop {
            let (operator, sign) = if self.takes('*') {
                (Operator::Times, 1.0)
            } else if self.takes('/') {
                (Operator::Over, -1.0)
            } else {
                return Ok((steps, exponents, span));
            };
            let (right, of_right, right_span) = self.signed()?;
            exponents = exponents.plus(of_right, sign);
            span = span.start..right_span.end;
            steps.extend(right);
            steps.push(Step::Binary(operator));
        }
    }

    fn signed(&mut self) -> Result<Part, Mistake> {
        let start = self.span().start;
        if self.takes('-') {
            let (mut steps, exponents, span) = self.deeper("too many signs")?;
            steps.push(Step::Negative);
            return Ok((steps, exponents, start..span.end));
        }
        self.power()
    }

    /// What stands behind a sign or below a power.
    fn deeper(&mut self, too_deep: &str) -> Result<Part, Mistake> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(self.mistake(too_deep, "write it shorter"));
        }
        let part = self.signed()?;
        self.depth -= 1;
        Ok(part)
    }

    fn power(&mut self) -> Result<Part, Mistake> {
        let (mut base, exponents, span) = self.atom()?;
        if !self.takes('^') {
            return Ok((base, exponents, span));
        }
        let (power, of_power, power_span) = self.deeper("too many powers of powers")?;
        let wrong = |message: String| Mistake {
            span: power_span.clone(),
            message,
            help: String::from("a power is a plain number, such as 2 or 0.5"),
        };
        if of_power != NONE {
            return Err(wrong(format!("this is {}", of_power.name())));
        }
        let raised = if exponents == NONE {
            NONE
        } else if !power.iter().any(|step| matches!(step, Step::Name(_))) {
            exponents.times(value_of(&power, &[]))
        } else {
            return Err(wrong(String::from(
                "a power that varies needs a plain number below it",
            )));
        };
        base.extend(power);
        base.push(Step::Binary(Operator::Power));
        Ok((base, raised, span.start..power_span.end))
    }

    fn atom(&mut self) -> Result<Part, Mistake> {
        let span = self.span();
        match self.token().cloned() {
            Some(Token::Number(value, exponents)) => {
                self.at += 1;
                Ok((vec![Step::Number(value)], exponents, span))
            }
            Some(Token::Sign('(')) => {
                self.at += 1;
                let (steps, exponents, inner) = self.sum()?;
                self.closed()?;
                Ok((steps, exponents, span.start..inner.end + 1))
            }
            Some(Token::Name(name)) => {
                self.at += 1;
                if self.token() == Some(&Token::Sign('(')) {
                    return self.call(&name, span);
                }
                let index = self.names.iter().position(|(known, _)| *known == name);
                let Some(index) = index else {
                    self.at -= 1;
                    let known: Vec<&str> =
                        self.names.iter().map(|(known, _)| known.as_str()).collect();
                    let all = format!("names here: {}", known.join(", "));
                    let help = advice(&name, known, &all);
                    return Err(self.mistake(format!("\"{name}\" is no name here"), &help));
                };
                Ok((vec![Step::Name(index)], self.names[index].1, span))
            }
            _ => Err(self.mistake(
                "a value is needed here",
                "write a number with its unit, a name or a parenthesis",
            )),
        }
    }

    fn closed(&mut self) -> Result<(), Mistake> {
        if self.takes(')') {
            return Ok(());
        }
        Err(self.mistake(") is needed here", "close the parenthesis"))
    }

    fn call(&mut self, name: &str, span: Range<usize>) -> Result<Part, Mistake> {
        let known = FUNCTIONS.iter().find(|(known, _)| *known == name);
        let Some((_, function)) = known else {
            self.at -= 1;
            let known: Vec<&str> = FUNCTIONS.iter().map(|(known, _)| *known).collect();
            let all = format!("functions: {}", known.join(", "));
            let help = advice(name, known, &all);
            return Err(self.mistake(format!("\"{name}\" is no function"), &help));
        };
        self.at += 1;
        let first = self.sum()?;
        let mut steps = first.0;
        let exponents = first.1;
        let several = matches!(function, Function::Min | Function::Max);
        let mut count = 1;
        while several && self.takes(',') {
            let next = self.sum()?;
            if next.1 != exponents {
                return Err(Mistake {
                    message: format!(
                        "this is {}; {} is needed here",
                        next.1.name(),
                        exponents.name()
                    ),
                    help: String::from("compare what has the same dimension"),
                    span: next.2,
                });
            }
            steps.extend(next.0);
            count += 1;
        }
        let end = self.span().end;
        self.closed()?;
        let result = match function {
            Function::Sqrt => exponents.times(0.5),
            Function::Ln | Function::Exp if exponents != NONE => {
                return Err(Mistake {
                    span: first.2,
                    message: format!("this is {}; {name} takes a plain number", exponents.name()),
                    help: String::from("divide it by a value of its dimension"),
                });
            }
            _ => exponents,
        };
        steps.push(Step::Call(*function, count));
        Ok((steps, result, span.start..end))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taxel::quantity::{FORCE, LENGTH};

    fn names() -> Vec<(String, Exponents)> {
        vec![
            (String::from("gap"), Exponents::of(&LENGTH)),
            (String::from("load"), Exponents::of(&FORCE)),
            (String::from("share"), NONE),
        ]
    }

    fn value(text: &str) -> f64 {
        let read = expression(text, &names()).unwrap_or_else(|mistake| panic!("{mistake:?}"));
        read.value(&[20e-6, 5.0, 0.5])
    }

    #[test]
    fn precedence_is_that_of_algebra() {
        for (text, expected) in [
            ("1 + 2 * 3", 7.0),
            ("(1 + 2) * 3", 9.0),
            ("-2 ^ 2", -4.0),
            ("2 ^ -1", 0.5),
            ("7 - 2 - 1", 4.0),
            ("8 / 2 / 2", 2.0),
            ("gap / (1 um)", 20.0),
            ("min(share, 3 %) * 100", 3.0),
            ("max(gap, 1 um, 30 um, 7 um) / (1 um)", 30.0),
            ("min(share, 4, 3 %, 1) * 100", 3.0),
            ("max(share)", 0.5),
            ("sqrt(gap * gap) / gap", 1.0),
            ("load / (2 kN/m) / (1 mm)", 2.5),
            ("ln(exp(share))", 0.5),
            ("abs(-3)", 3.0),
        ] {
            assert!(
                (value(text) - expected).abs() < 1e-12,
                "{text}: {}",
                value(text)
            );
        }
    }

    #[test]
    fn mistakes_are_marked_under_the_word() {
        for (text, word) in [
            ("gap - 200 kPa", "200 kPa"),
            ("gap + load", "load"),
            ("gap * hight", "hight"),
            ("ln(gap)", "gap"),
            ("gap ^ gap", "gap"),
            ("2 gap", "gap"),
            ("gap $ 2", "$"),
            ("sin(share)", "sin"),
            ("min(gap, 1 um, 1 N)", "1 N"),
            ("sqrt(share, 1)", ","),
            ("(gap", "p"),
        ] {
            let mistake = expression(text, &names()).unwrap_err();
            assert_eq!(&text[mistake.span.clone()], word, "{text}: {mistake:?}");
        }
        assert!(comparison("gap >= 1 N", &names()).is_err());
        assert!(comparison("gap", &names()).is_err());
        let deep = format!("{}1{}", "(".repeat(200), ")".repeat(200));
        assert!(expression(&deep, &names()).is_err());
        assert!(expression(&"-".repeat(200), &names()).is_err());
        assert!(expression(&format!("2{}", "^2".repeat(20_000)), &names()).is_err());
        let deep = format!("{}1{}", "min(1, ".repeat(20_000), ")".repeat(20_000));
        assert!(expression(&deep, &names()).is_err());
    }

    /// A chain is as deep as one factor: it is read, evaluated, copied and dropped on any stack.
    #[test]
    fn a_chain_of_twenty_thousand_factors_is_a_number() {
        for (link, expected) in [
            (" * 1.5 um / 1.5 um", 5.0),
            (" + 0 N", 5.0),
            (" - 0.0001 N", 3.0),
        ] {
            let text = format!("load{}", link.repeat(20_000));
            let read = expression(&text, &names()).unwrap_or_else(|mistake| panic!("{mistake:?}"));
            // Each of 40 000 operations rounds by at most 1.1e-16 of it.
            let found = read.clone().value(&[20e-6, 5.0, 0.5]);
            assert!(
                (found - expected).abs() < 40_000.0 * 1.2e-16 * 5.0,
                "{link}: {found}"
            );
        }
    }

    #[test]
    fn an_excess_is_a_share_of_the_limit() {
        let holds = comparison("gap >= 10 um", &names()).unwrap_or_else(|m| panic!("{m:?}"));
        assert!((holds.excess(&[20e-6, 0.0, 0.0]) + 0.5).abs() < 1e-12);
        assert!(holds.excess(&[5e-6, 0.0, 0.0]) > 0.0);
        assert!(holds.excess(&[f64::NAN, 0.0, 0.0]).is_nan());
    }
}
