//! Texts in the formats of masks.

/// A text of printable ASCII characters: the formats of masks have no others.
pub(crate) fn ascii(text: &str) -> String {
    let plain = |letter: char| match letter {
        'µ' | 'μ' => 'u',
        letter if letter.is_ascii_graphic() || letter == ' ' => letter,
        _ => '?',
    };
    text.chars().map(plain).collect()
}
