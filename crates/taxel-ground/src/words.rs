//! Words that were misspelt.

/// Number of letters to change, insert, remove, or swap with the next (restricted edit distance).
pub fn distance(a: &str, b: &str) -> usize {
    let [a, b] = [a, b].map(|word| word.chars().collect::<Vec<char>>());
    let mut rows = vec![(0..=b.len()).collect::<Vec<usize>>()];
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let changed = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut least = changed.min(rows[i - 1][j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                least = least.min(rows[i - 2][j - 2] + 1);
            }
            row.push(least);
        }
        rows.push(row);
    }
    rows[a.len()][b.len()]
}

/// The first of the names that are nearest to `word`, if `word` may be a slip of it: a third of the
/// longer one at most differs, so that a name of two letters is guessed for no other.
///
/// ```
/// use taxel_ground::words::meant;
/// assert_eq!(meant("capacitence", ["capacitance", "change"]), Some("capacitance"));
/// assert_eq!(meant("conut", ["name", "count"]), Some("count"));
/// assert_eq!(meant("fy", ["fz", "u"]), None);
/// ```
pub fn meant<'k>(word: &str, known: impl IntoIterator<Item = &'k str>) -> Option<&'k str> {
    let slips = |name: &&str| distance(word, name);
    let nearest = known.into_iter().min_by_key(slips)?;
    let longer = word.chars().count().max(nearest.chars().count());
    (3 * slips(&nearest) <= longer).then_some(nearest)
}

/// Advice for a `word` that is none of `known`: the one that may be meant, then `otherwise`.
///
/// ```
/// let help = taxel_ground::words::advice("chek", ["check", "predict"], "use one of: check, predict");
/// assert_eq!(help, "did you mean \"check\"? use one of: check, predict");
/// ```
pub fn advice<'k>(word: &str, known: impl IntoIterator<Item = &'k str>, otherwise: &str) -> String {
    match meant(word, known) {
        Some(name) => format!("did you mean \"{name}\"? {otherwise}")
            .trim_end()
            .to_owned(),
        None => otherwise.to_owned(),
    }
}
