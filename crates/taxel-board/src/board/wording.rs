//! Mistakes in a board file under the very place.

use std::ops::Range;

use taxel_ground::InputError;

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
