//! Mistakes of types and choices in words for people: the reading library names types of Rust.

/// The message of the library in words; none where it is no mistake of a type or a number.
pub(super) fn in_words(message: &str) -> Option<String> {
    of_type(message).or_else(|| of_number(message))
}

/// `invalid type: string "x", expected usize`
fn of_type(message: &str) -> Option<String> {
    match message {
        "invalid type: unit variant, expected newtype variant" => {
            return Some("this has keys of its own, which are missing".into());
        }
        "wanted string or table" => return Some("text or a table is needed here".into()),
        _ => {}
    }
    let said = message
        .strip_prefix("invalid type: ")
        .or_else(|| message.strip_prefix("invalid value: "))
        .or_else(|| message.strip_prefix("expected table, found "));
    let (found, expected) = match said? {
        found if message.starts_with("expected table, ") => (found, "a map"),
        said => said.rsplit_once(", expected ")?,
    };
    let expected = match expected {
        "u8" => "a whole number from 0 to 255",
        "u16" => "a whole number from 0 to 65535",
        "u32" => "a whole number from 0 to 4294967295",
        "u64" | "usize" => "a whole number of 0 or more",
        "i64" | "isize" | "i32" => "a whole number",
        "f64" => "a number",
        "a string" | "string" => "text in quotes",
        "a boolean" | "bool" => "true or false",
        "a sequence" => "a list",
        "a map" => "a table",
        "an array of length 2" => "a list of 2",
        "an array of length 3" => "a list of 3",
        expected if expected.starts_with("struct ") || expected.contains("enum") => "a table",
        expected => expected,
    };
    let found = found.replace('`', "");
    let found = match found.split_once(' ') {
        Some(("integer" | "boolean" | "floating", number)) => {
            number.trim_start_matches("point ").to_owned()
        }
        Some(("string", text)) => format!("the text {text}"),
        _ => match found.as_str() {
            "map" => "a table".into(),
            "sequence" => "a list".into(),
            "boolean" => "true or false".into(),
            _ => found,
        },
    };
    Some(format!("{expected} is needed here, not {found}"))
}

/// "unknown variant `x`, expected one of `a`, `b`": the message in words, and the names that are
/// known.
pub(super) fn of_choice(message: &str) -> Option<[String; 2]> {
    let said = message.strip_prefix("unknown variant `")?;
    let (found, expected) = said.split_once("`, expected ")?;
    let names = expected.trim_start_matches("one of ").replace('`', "");
    Some([
        format!("\"{found}\" is not known here"),
        names.replace(" or ", ", "),
    ])
}

/// "missing field `x`": the key that is missing.
pub(super) fn of_missing(message: &str) -> Option<&str> {
    let said = message.strip_prefix("missing field `")?;
    said.split('`').next()
}

/// "unknown field `x`, expected one of `a`, `b`" or "unknown variant ...": the word that is not known,
/// and those that are.
pub(super) fn of_name(message: &str) -> Option<(&str, Vec<&str>)> {
    let said = message.strip_prefix("unknown ")?;
    let said = said
        .strip_prefix("field ")
        .or_else(|| said.strip_prefix("variant "))?;
    let mut quoted = said.split('`').skip(1);
    let word = quoted.next()?;
    Some((word, quoted.skip(1).step_by(2).collect()))
}

/// "invalid length 1, expected an array of length 2", "wanted exactly 1 element, found 0 elements"
fn of_number(message: &str) -> Option<String> {
    if message.starts_with("wanted exactly 1 element") {
        return Some("exactly one table is needed here, whose name says the kind".into());
    }
    let said = message.strip_prefix("invalid length ")?;
    let (found, expected) = said.split_once(", expected an array of length ")?;
    Some(format!(
        "a list of {expected} is needed here, not one of {found}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_and_choices_are_told_in_words() {
        for (message, words) in [
            (
                "invalid type: string \"x\", expected usize",
                "a whole number of 0 or more is needed here, not the text \"x\"",
            ),
            (
                "invalid value: integer `-1`, expected u32",
                "a whole number from 0 to 4294967295 is needed here, not -1",
            ),
            (
                "invalid type: floating point `1.5`, expected usize",
                "a whole number of 0 or more is needed here, not 1.5",
            ),
            (
                "invalid type: string \"1 MPa\", expected struct Bulk",
                "a table is needed here, not the text \"1 MPa\"",
            ),
            (
                "expected table, found boolean",
                "a table is needed here, not true or false",
            ),
            (
                "invalid length 1, expected an array of length 2",
                "a list of 2 is needed here, not one of 1",
            ),
            (
                "wanted exactly 1 element, found 0 elements",
                "exactly one table is needed here, whose name says the kind",
            ),
        ] {
            assert_eq!(in_words(message).unwrap(), words);
        }
        assert_eq!(in_words("missing field `name`"), None);
        assert_eq!(
            of_choice("unknown variant `middle`, expected `little` or `big`").unwrap(),
            ["\"middle\" is not known here", "little, big"]
        );
    }
}
