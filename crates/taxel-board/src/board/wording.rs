//! Mistakes in a board file in words for people, under the very place.

use std::ops::Range;

use taxel_recording::InputError;

/// The mistake in words that need no knowledge of this program.
pub(super) fn in_words(error: InputError) -> InputError {
    let message = of_type(&error.message)
        .or_else(|| of_choice(&error.message))
        .or_else(|| of_number(&error.message))
        .unwrap_or_else(|| error.message.clone());
    let help = error.help.replace("`taxel schema`", "`taxel schema board`");
    InputError {
        message,
        help,
        ..error
    }
}

/// `invalid type: string "x", expected usize`
fn of_type(message: &str) -> Option<String> {
    let said = message
        .strip_prefix("invalid type: ")
        .or_else(|| message.strip_prefix("invalid value: "))?;
    let (found, expected) = said.rsplit_once(", expected ")?;
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
            _ => found,
        },
    };
    Some(format!("{expected} is needed here, not {found}"))
}

/// "unknown variant `x`, expected one of `a`, `b`"
fn of_choice(message: &str) -> Option<String> {
    let said = message.strip_prefix("unknown variant `")?;
    let (found, expected) = said.split_once("`, expected ")?;
    let names = expected.trim_start_matches("one of ").replace('`', "");
    Some(format!("\"{found}\" is not known here; use one of: {names}").replace(" or ", ", "))
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

/// The mistake under these bytes of the text in quotes at its place.
pub(super) fn narrowed(mut error: InputError, within: Range<usize>) -> InputError {
    let Some(place) = &mut error.place else {
        return error;
    };
    let quoted: String = place
        .text
        .chars()
        .skip(place.column - 1)
        .take(place.width)
        .collect();
    // With an escape in the text its bytes stand elsewhere.
    let text = quoted
        .strip_prefix(['"', '\''])
        .and_then(|text| text.strip_suffix(['"', '\'']))
        .filter(|text| !text.contains('\\') && !text.starts_with(['"', '\'']));
    let part = text.and_then(|text| Some((text.get(..within.start)?, text.get(within)?)));
    if let Some((before, part)) = part {
        place.column += 1 + before.chars().count();
        place.width = part.chars().count().max(1);
    }
    error
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
                "unknown variant `middle`, expected `little` or `big`",
                "\"middle\" is not known here; use one of: little, big",
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
            let error = in_words(InputError::whole("f", message));
            assert_eq!(error.message, words);
        }
    }
}
