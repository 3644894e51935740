//! Files with extreme values in the place of their numbers.
#![allow(dead_code, unreachable_pub, clippy::unwrap_used)]

use std::ops::Range;

/// Put in the place of each number; its unit stays.
pub const EXTREMES: [&str; 14] = [
    "1e308", "-1e308", "5e-324", "-5e-324", "1e-15", "1e15", "1e-9", "1e9", "1e-6", "1e6", "1e3",
    "0", "-1", "1e-3",
];

/// Byte ranges of the numbers behind the equal signs, comments aside.
pub fn numbers(text: &str) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        let code = line.split('#').next().unwrap();
        let mut at = code.find('=').map_or(code.len(), |equal| equal + 1);
        while let Some(length) = code[at..].find(|c: char| c.is_ascii_digit()) {
            let mut first = at + length;
            let end = code[first..].find(|c: char| !(c.is_ascii_digit() || ".e".contains(c)));
            at = end.map_or(code.len(), |end| first + end);
            if code[..first].ends_with('-') {
                first -= 1;
            }
            let inside_a_word = code[..first].ends_with(|c: char| c.is_alphanumeric() || c == '_');
            if !inside_a_word {
                found.push(start + first..start + at);
            }
        }
        start += line.len();
    }
    found
}

/// Every text with one number of `text` replaced by one extreme.
pub fn variants(text: &str) -> Vec<String> {
    let replaced = |range: Range<usize>| {
        EXTREMES.map(|extreme| {
            let mut variant = text.to_owned();
            variant.replace_range(range.clone(), extreme);
            variant
        })
    };
    numbers(text).into_iter().flat_map(replaced).collect()
}
