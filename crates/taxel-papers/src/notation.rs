//! The tables write equations in plain text, `eps0 eps_r w_e (U/D)^gamma`; a page sets them.

use std::iter::Peekable;
use std::str::Chars;

use taxel::svg::escape;

const GREEK: [(&str, &str); 25] = [
    ("alpha", "α"),
    ("beta", "β"),
    ("gamma", "γ"),
    ("delta", "δ"),
    ("Delta", "Δ"),
    ("eps", "ε"),
    ("epsilon", "ε"),
    ("zeta", "ζ"),
    ("eta", "η"),
    ("theta", "θ"),
    ("kappa", "κ"),
    ("lambda", "λ"),
    ("mu", "μ"),
    ("nu", "ν"),
    ("pi", "π"),
    ("Pi", "Π"),
    ("rho", "ρ"),
    ("sigma", "σ"),
    ("tau", "τ"),
    ("phi", "φ"),
    ("chi", "χ"),
    ("psi", "ψ"),
    ("omega", "ω"),
    ("sqrt", "√"),
    ("um", "µm"),
];
/// Units of length, whose digits are powers.
const LENGTHS: [&str; 4] = ["m", "mm", "cm", "um"];
/// Letters of a symbol, and of its subscript, at most: `as_layer` is a key.
const SYMBOL: usize = 2;
const SUBSCRIPT: usize = 4;

/// A text of a table as HTML: Greek letters, subscripts, powers, primes and signs.
///
/// `x1^2` has a subscript and a power, `mm2` a power; P1 to P4 are papers.
pub(crate) fn html(text: &str) -> String {
    let mut page = String::new();
    let mut rest = text.chars().peekable();
    while let Some(&next) = rest.peek() {
        if next.is_ascii_alphabetic() {
            word(&mut rest, &mut page);
        } else if next.is_ascii_digit() {
            // A number with its exponent, or a name that begins with a digit.
            page += &taken(&mut rest, |c| c.is_ascii_alphanumeric() || c == '.');
        } else {
            rest.next();
            match next {
                '^' => power(&mut rest, &mut page),
                '-' if page.ends_with(' ') && rest.peek() == Some(&' ') => page.push('−'),
                '+' if rest.next_if_eq(&'-').is_some() => page.push('±'),
                '<' if rest.next_if_eq(&'=').is_some() => page.push('≤'),
                '>' if rest.next_if_eq(&'=').is_some() => page.push('≥'),
                _ => page += &escape(&next.to_string()),
            }
        }
    }
    page
}

/// A word, or a symbol with its subscript and its primes.
fn word(rest: &mut Peekable<Chars<'_>>, page: &mut String) {
    let letters = taken(rest, |c| c.is_ascii_alphabetic());
    let digits = taken(rest, |c| c.is_ascii_digit());
    let greek = GREEK.iter().find(|(name, _)| *name == letters);
    *page += greek.map_or(letters.as_str(), |(_, letter)| letter);
    let symbol = greek.is_some() || letters.len() <= SYMBOL;
    let paper = letters == "P" && digits.len() == 1;
    if digits.is_empty() || !symbol || paper {
        *page += &digits;
    } else if LENGTHS.contains(&letters.as_str()) {
        *page += &tagged("sup", &digits);
    } else {
        *page += &tagged("sub", &digits);
    }
    if rest.next_if_eq(&'_').is_some() {
        let below = taken(rest, |c| c.is_ascii_alphanumeric());
        if symbol && !below.is_empty() && below.len() <= SUBSCRIPT {
            *page += &tagged("sub", &below);
        } else {
            page.push('_');
            *page += &below;
        }
    }
    while symbol && rest.peek() == Some(&'\'') {
        let after = rest.clone().nth(1);
        if after.is_some_and(|c| c.is_ascii_alphabetic()) {
            break;
        }
        rest.next();
        page.push('′');
    }
}

/// A power: what stands in brackets, or a signed number or word.
fn power(rest: &mut Peekable<Chars<'_>>, page: &mut String) {
    let mut inside = String::new();
    if rest.next_if_eq(&'(').is_some() {
        let mut open = 1;
        for c in rest.by_ref() {
            open += match c {
                '(' => 1,
                ')' => -1,
                _ => 0,
            };
            if open == 0 {
                break;
            }
            inside.push(c);
        }
    } else {
        inside += &taken(rest, |c| c == '-');
        inside += &taken(rest, |c| c.is_ascii_alphanumeric());
    }
    *page += &tagged("sup", &html(&inside).replace('-', "−"));
}

fn tagged(tag: &str, text: &str) -> String {
    ["<", tag, ">", text, "</", tag, ">"].concat()
}

fn taken(rest: &mut Peekable<Chars<'_>>, of: impl Fn(char) -> bool) -> String {
    let mut text = String::new();
    while let Some(c) = rest.next_if(|c| of(*c)) {
        text.push(c);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::html;

    #[test]
    fn equations_are_set() {
        for (plain, set) in [
            (
                "eps0 eps_r w_e (T/D - t/d) q (U/D)^gamma",
                "ε<sub>0</sub> ε<sub>r</sub> w<sub>e</sub> (T/D − t/d) q (U/D)<sup>γ</sup>",
            ),
            (
                "-P + C1 g^2 + C2 x1^2 f'^2",
                "-P + C<sub>1</sub> g<sup>2</sup> + C<sub>2</sub> x<sub>1</sub><sup>2</sup> f′<sup>2</sup>",
            ),
            (
                "b_s (x1' - x2'), d_eff0 < 1",
                "b<sub>s</sub> (x<sub>1</sub>′ − x<sub>2</sub>′), d<sub>eff0</sub> &lt; 1",
            ),
            ("1/(m sqrt(2 pi))", "1/(m √(2 π))"),
            ("e^(-t/tau)", "e<sup>−t/τ</sup>"),
            (
                "1.0 mm2, 8e6 N/m^2",
                "1.0 mm<sup>2</sup>, 8e6 N/m<sup>2</sup>",
            ),
            ("110e-12 C/N, +-20 %, 2e-3", "110e-12 C/N, ±20 %, 2e-3"),
            (
                "P1 Eq. 4c, Young's as_layer, patch_x of SU-8, T(11)",
                "P1 Eq. 4c, Young's as_layer, patch_x of SU-8, T(11)",
            ),
            ("10 um, 10^2's", "10 µm, 10<sup>2</sup>'s"),
        ] {
            assert_eq!(html(plain), set);
        }
    }
}
