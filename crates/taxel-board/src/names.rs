//! Names of values: one pattern stands for many.

/// Most values of a board.
pub(crate) const MOST_VALUES: usize = 4096;

/// The names that a pattern stands for, in order: `m{1..2}.{x,y}` is `m1.x`, `m1.y`, `m2.x`,
/// `m2.y`; `c1..c4` is `c1` to `c4`.
///
/// # Errors
/// A message for people when a brace is not closed, a range is not one of whole numbers, or
/// there would be more than 4096 names.
pub(crate) fn expanded(pattern: &str) -> Result<Vec<String>, String> {
    if !pattern.contains('{')
        && let Some((first, last)) = pattern.split_once("..")
    {
        return of_ends(first, last);
    }
    let mut names = vec![String::new()];
    let mut rest = pattern;
    while let Some((before, inner)) = rest.split_once('{') {
        let Some((inside, after)) = inner.split_once('}') else {
            return Err(format!("\"{pattern}\" has a brace that is not closed"));
        };
        let choices = choices(inside)?;
        if names.len().saturating_mul(choices.len()) > MOST_VALUES {
            return Err(format!(
                "\"{pattern}\" stands for more than {MOST_VALUES} names"
            ));
        }
        names = names
            .iter()
            .flat_map(|name| {
                choices
                    .iter()
                    .map(move |choice| format!("{name}{before}{choice}"))
            })
            .collect();
        rest = after;
    }
    for name in &mut names {
        name.push_str(rest);
    }
    match names.iter().find(|name| !is_name(name)) {
        Some(wrong) => Err(format!(
            "\"{wrong}\" is no name: letters, digits, `_`, `.` and `-` make one"
        )),
        None => Ok(names),
    }
}

/// `c1` to `c4`.
fn of_ends(first: &str, last: &str) -> Result<Vec<String>, String> {
    let split = |end: &str| {
        let word = end.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        let (word, digits) = end.split_at(word);
        Some((word.to_owned(), digits.parse::<usize>().ok()?))
    };
    let wrong = || format!("\"{first}..{last}\" is no range of names; write one such as c1..c4");
    let ((word, from), (other, to)) = (
        split(first).ok_or_else(wrong)?,
        split(last).ok_or_else(wrong)?,
    );
    if word != other || !is_name(first) {
        return Err(wrong());
    }
    Ok(numbers(from, to)?
        .into_iter()
        .map(|number| format!("{word}{number}"))
        .collect())
}

fn choices(inside: &str) -> Result<Vec<String>, String> {
    if let Some((from, to)) = inside.split_once("..") {
        let number = |text: &str| {
            text.trim()
                .parse::<usize>()
                .map_err(|_| format!("\"{{{inside}}}\" is no range; write one such as {{1..4}}"))
        };
        return Ok(numbers(number(from)?, number(to)?)?
            .into_iter()
            .map(|number| number.to_string())
            .collect());
    }
    Ok(inside
        .split(',')
        .map(|choice| choice.trim().to_owned())
        .collect())
}

fn numbers(from: usize, to: usize) -> Result<Vec<usize>, String> {
    if from > to || to - from >= MOST_VALUES {
        return Err(format!(
            "the range {from}..{to} must rise and hold at most {MOST_VALUES} numbers"
        ));
    }
    Ok((from..=to).collect())
}

/// Rows and columns of names such as `r0c0`, `r0c1`, `r1c0`, `r1c1`: all of a grid, row by row.
pub(crate) fn grid(names: &[&str]) -> Option<[usize; 2]> {
    let (row, column) = names.last()?.strip_prefix('r')?.split_once('c')?;
    let after = |text: &str| text.parse::<usize>().ok()?.checked_add(1);
    let (rows, columns) = (after(row)?, after(column)?);
    let place = |at: usize| format!("r{}c{}", at / columns, at % columns);
    let whole = rows.checked_mul(columns) == Some(names.len());
    let in_order = || {
        names
            .iter()
            .enumerate()
            .all(|(at, name)| *name == place(at))
    };
    (whole && in_order()).then_some([rows, columns])
}

/// A pattern of these names: `c1..c4` where the numbers follow each other.
pub(crate) fn contracted(names: &[&str]) -> String {
    let [first, .., last] = names else {
        return names.concat();
    };
    let range = format!("{first}..{last}");
    if expanded(&range).is_ok_and(|expanded| expanded == names) {
        range
    } else {
        format!("{{{}}}", names.join(","))
    }
}

fn is_name(name: &str) -> bool {
    !name.is_empty()
        && name.len() <= 64
        && name
            .chars()
            .all(|c| c.is_alphanumeric() || matches!(c, '_' | '.' | '-'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_rows_and_columns_are_a_grid() {
        let grid_of = |pattern| {
            let names = expanded(pattern).unwrap_or_default();
            grid(&names.iter().map(String::as_str).collect::<Vec<_>>())
        };
        assert_eq!(grid_of("r{0..11}c{0..31}"), Some([12, 32]));
        // Neither counted from 1, nor column by column, nor other names.
        assert_eq!(grid_of("r{1..2}c{1..2}"), None);
        assert_eq!(grid(&["r0c0", "r1c0", "r0c1", "r1c1"]), None);
        assert_eq!(grid_of("c{0..3}"), None);
    }

    #[test]
    fn patterns_expand_in_order() {
        let names = |pattern| expanded(pattern).unwrap_or_default().join(" ");
        assert_eq!(names("fx"), "fx");
        assert_eq!(names("m{1..2}.{x,y}"), "m1.x m1.y m2.x m2.y");
        assert_eq!(names("c9..c11"), "c9 c10 c11");
    }

    #[test]
    fn contraction_is_undone() {
        for names in [
            &["c1", "c2", "c3"][..],
            &["fx", "fy"],
            &["x"],
            &["m1.x", "m2.x"],
        ] {
            assert_eq!(expanded(&contracted(names)).unwrap_or_default(), names);
        }
        assert_eq!(contracted(&["c9", "c10"]), "c9..c10");
    }

    #[test]
    fn a_wrong_pattern_is_refused() {
        for wrong in [
            "",
            "m{1..}",
            "m{1",
            "c4..c1",
            "c1..d4",
            "a b",
            "m{0..9999999999}",
            "{1..99}{1..99}{1..99}",
        ] {
            assert!(expanded(wrong).is_err(), "{wrong}");
        }
    }
}
