//! The queries of the lab streaming layer: conditions of XPath on the fields of a stream.

/// What a query says of a stream whose fields `field` gives; `None` for one that cannot be read, which no
/// stream answers.
pub(super) fn holds(query: &str, field: &dyn Fn(&str) -> Option<String>) -> Option<bool> {
    let mut query = Query {
        rest: query.trim(),
        field,
        depth: 0,
    };
    if query.rest.is_empty() {
        return Some(true);
    }
    let found = query.any()?;
    query.rest.is_empty().then_some(found)
}

/// Deepest nesting: a query comes from whoever is on the network.
const DEEPEST: usize = 16;

struct Query<'a> {
    rest: &'a str,
    field: &'a dyn Fn(&str) -> Option<String>,
    depth: usize,
}

/// A relation of two values, by its name.
type Named<T> = (&'static str, fn(&T, &T) -> bool);

/// One side of a comparison.
enum Term {
    Text(String),
    Number(f64),
}

impl Query<'_> {
    /// Passes over a word or sign.
    fn take(&mut self, word: &str) -> bool {
        let Some(rest) = self.rest.strip_prefix(word) else {
            return false;
        };
        let goes_on = rest.starts_with(|c: char| c.is_alphanumeric() || c == '_' || c == '-');
        if word.ends_with(char::is_alphabetic) && goes_on {
            return false;
        }
        self.rest = rest.trim_start();
        true
    }

    fn any(&mut self) -> Option<bool> {
        self.depth += 1;
        let mut found = self.all().filter(|_| self.depth <= DEEPEST)?;
        while self.take("or") {
            found |= self.all()?;
        }
        self.depth -= 1;
        Some(found)
    }

    fn all(&mut self) -> Option<bool> {
        let mut found = self.one()?;
        while self.take("and") {
            found &= self.one()?;
        }
        Some(found)
    }

    fn one(&mut self) -> Option<bool> {
        if self.depth > DEEPEST {
            return None;
        }
        let negated = self.take("not");
        if self.take("(") {
            let found = self.any()?;
            return self.take(")").then_some(found != negated);
        }
        if negated {
            return None;
        }
        let parts: [Named<str>; 2] = [
            ("starts-with", |text, part| text.starts_with(part)),
            ("contains", |text, part| text.contains(part)),
        ];
        for (name, is) in parts {
            if self.take(name) {
                let whole = self.take("(").then(|| self.text())??;
                let part = self.take(",").then(|| self.text())??;
                return self.take(")").then(|| is(&whole, &part));
            }
        }
        let left = self.term()?;
        let signs: [Named<f64>; 6] = [
            ("!=", |a, b| a != b),
            ("<=", |a, b| a <= b),
            (">=", |a, b| a >= b),
            ("=", |a, b| a == b),
            ("<", |a, b| a < b),
            (">", |a, b| a > b),
        ];
        let (sign, is) = signs.into_iter().find(|(sign, _)| self.take(sign))?;
        let right = self.term()?;
        Some(match (&left, &right, sign) {
            (Term::Text(left), Term::Text(right), "=") => left == right,
            (Term::Text(left), Term::Text(right), "!=") => left != right,
            _ => is(&left.number(), &right.number()),
        })
    }

    fn text(&mut self) -> Option<String> {
        match self.term()? {
            Term::Text(text) => Some(text),
            Term::Number(number) => Some(number.to_string()),
        }
    }

    /// A text in quotes, a number, or a field; the text of one that the stream does not have is empty.
    fn term(&mut self) -> Option<Term> {
        let quote = self.rest.chars().next()?;
        if quote == '\'' || quote == '"' {
            let (text, rest) = self.rest[1..].split_once(quote)?;
            self.rest = rest.trim_start();
            return Some(Term::Text(text.to_owned()));
        }
        let is_name = |c: char| c.is_ascii_alphanumeric() || "_-./+".contains(c);
        let end = self.rest.find(|c| !is_name(c)).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest.trim_start();
        if word.is_empty() {
            return None;
        }
        if let Ok(number) = word.parse() {
            return Some(Term::Number(number));
        }
        if self.take("()") {
            // `text()` and other functions are not read.
            return None;
        }
        Some(Term::Text((self.field)(word).unwrap_or_default()))
    }
}

impl Term {
    fn number(&self) -> f64 {
        match self {
            Self::Number(number) => *number,
            Self::Text(text) => text.trim().parse().unwrap_or(f64::NAN),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn queries_are_those_of_the_published_library() {
        let field = |name: &str| {
            let fields = [
                ("name", "taxel force"),
                ("type", "Force"),
                ("session_id", "default"),
                ("channel_count", "12"),
            ];
            let found = fields.iter().find(|(key, _)| *key == name);
            found.map(|(_, value)| (*value).to_owned())
        };
        for (query, found) in [
            ("", Some(true)),
            ("session_id='default'", Some(true)),
            ("session_id='default' and type='Force'", Some(true)),
            ("session_id='default' and type=\"EEG\"", Some(false)),
            ("type='EEG' or name='taxel force'", Some(true)),
            ("not(type='EEG') and channel_count>=12", Some(true)),
            ("channel_count < 12", Some(false)),
            ("starts-with(name,'taxel')", Some(true)),
            ("contains(name, 'events') or (type != 'Force')", Some(false)),
            ("nothing='there'", Some(false)),
            ("count(desc/channel)=3", None),
            ("type='Force", None),
            ("type='Force' name", None),
        ] {
            assert_eq!(holds(query, &field), found, "{query}");
        }
        assert_eq!(holds(&"(".repeat(100_000), &field), None);
        assert_eq!(holds(&"not(".repeat(100_000), &field), None);
    }
}
