//! Lines of text and numbers of a binary part, in the order of a file.

use super::error::{GmshError, Position};

/// Bytes of a file that are not read yet.
pub(super) struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Lines so far; of no meaning after a binary part.
    number: usize,
    section: String,
    /// Byte order of the numbers; none in a file of text.
    binary: Option<Order>,
    place: Position,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Order {
    Little,
    Big,
}

/// The words of a line, or the numbers of a binary part from here on.
pub(super) struct Words<'r, 'a> {
    reader: &'r mut Reader<'a>,
    /// Words of a line; none in a binary part.
    text: Option<std::vec::IntoIter<String>>,
    found: usize,
}

impl<'a> Reader<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self {
            bytes,
            at: 0,
            number: 0,
            section: "$MeshFormat".to_owned(),
            binary: None,
            place: Position::Line(1),
        }
    }

    pub(super) fn is_binary(&self) -> bool {
        self.binary.is_some()
    }

    /// Where the last line or record begins.
    pub(super) fn position(&self) -> Position {
        self.place
    }

    pub(super) fn first_line(&self) -> Position {
        Position::Line(self.number.max(1))
    }

    /// The next line that is not empty, without spaces around it.
    pub(super) fn line(&mut self) -> Result<&'a str, GmshError> {
        while self.at < self.bytes.len() {
            let rest = &self.bytes[self.at..];
            let length = rest.iter().position(|&byte| byte == b'\n');
            let line = &rest[..length.unwrap_or(rest.len())];
            self.place = if self.binary.is_some() {
                Position::Byte(self.at)
            } else {
                Position::Line(self.number + 1)
            };
            self.at += length.map_or(rest.len(), |length| length + 1);
            self.number += 1;
            let Ok(line) = std::str::from_utf8(line) else {
                return Err(GmshError::NotText { line: self.place });
            };
            let line = line.trim();
            if !line.is_empty() {
                return Ok(line);
            }
        }
        Err(GmshError::EndOfFile {
            line: self.place,
            section: self.section.clone(),
        })
    }

    /// Name of the next section; none at the end of the file.
    pub(super) fn section(&mut self) -> Result<Option<String>, GmshError> {
        let line = match self.line() {
            Ok(line) => line,
            Err(GmshError::EndOfFile { .. }) => return Ok(None),
            Err(error) => return Err(error),
        };
        if !line.starts_with('$') {
            return Err(GmshError::Count {
                line: self.place,
                what: "lines outside a section",
                found: 1,
                expected: 0,
            });
        }
        line.clone_into(&mut self.section);
        Ok(Some(self.section.clone()))
    }

    /// Name of the present section.
    pub(super) fn section_name(&self) -> &str {
        &self.section
    }

    /// Reads the line that ends the section.
    pub(super) fn end(&mut self) -> Result<(), GmshError> {
        let line = self.line()?;
        if line.strip_prefix("$End") == self.section.strip_prefix('$') {
            return Ok(());
        }
        Err(GmshError::Count {
            line: self.place,
            what: "lines after the last one announced",
            found: 1,
            expected: 0,
        })
    }

    /// Passes over a section with its end.
    pub(super) fn skip(&mut self) -> Result<(), GmshError> {
        let end = self.section.replacen('$', "$End", 1);
        let rest = &self.bytes[self.at..];
        let found = rest
            .windows(end.len())
            .position(|window| window == end.as_bytes());
        let Some(found) = found else {
            self.at = self.bytes.len();
            return Err(GmshError::EndOfFile {
                line: self.place,
                section: self.section.clone(),
            });
        };
        self.number += rest[..found].split(|&byte| byte == b'\n').count() - 1;
        self.at += found;
        self.line().map(drop)
    }

    /// True if the format is the new one, 4.1.
    pub(super) fn format(&mut self) -> Result<bool, GmshError> {
        let words: Vec<&str> = self.line()?.split_whitespace().collect();
        self.count("entries of the format", words.len(), 3)?;
        let new = match words[0] {
            "2.2" | "2" => false,
            "4.1" => true,
            version => {
                return Err(GmshError::Version {
                    line: self.place,
                    version: version.to_owned(),
                });
            }
        };
        if words[1] != "0" {
            let binary = GmshError::Binary { line: self.place };
            let one = self.bytes.get(self.at..self.at + 4);
            self.binary = match one {
                Some([1, 0, 0, 0]) => Some(Order::Little),
                Some([0, 0, 0, 1]) => Some(Order::Big),
                _ => return Err(binary),
            };
            if words[1] != "1" || words[2] != "8" {
                return Err(binary);
            }
            self.at += 4;
        }
        self.end()?;
        Ok(new)
    }

    /// The words of the next line, or the numbers from here on.
    pub(super) fn words(&mut self) -> Result<Words<'_, 'a>, GmshError> {
        let text = if self.binary.is_some() {
            self.place = Position::Byte(self.at);
            None
        } else {
            let words = self.line()?.split_whitespace().map(str::to_owned);
            Some(words.collect::<Vec<_>>().into_iter())
        };
        Ok(Words {
            reader: self,
            text,
            found: 0,
        })
    }

    /// A whole line of integers, at least so many.
    pub(super) fn text_integers(
        &mut self,
        what: &'static str,
        least: usize,
    ) -> Result<Vec<i64>, GmshError> {
        let line = self.line()?;
        let parse = |word: &str| {
            let number = word.parse();
            number.map_err(|_| self.not_a_number(word, "a whole number"))
        };
        let numbers: Vec<i64> = line
            .split_whitespace()
            .map(parse)
            .collect::<Result<_, _>>()?;
        self.count(what, numbers.len(), least)?;
        Ok(numbers)
    }

    /// The numbers at the head of a section: at least so many of text, exactly so many binary.
    pub(super) fn head(&mut self, text: usize, binary: usize) -> Result<Vec<i64>, GmshError> {
        if self.binary.is_none() {
            return self.text_integers("entries", text);
        }
        let mut words = self.words()?;
        (0..binary).map(|_| words.long("entries")).collect()
    }

    /// The head of a block: three numbers and a count.
    pub(super) fn block(&mut self) -> Result<Vec<i64>, GmshError> {
        if self.binary.is_none() {
            return self.text_integers("entries of a block", 4);
        }
        let mut words = self.words()?;
        let mut block = Vec::new();
        for _ in 0..3 {
            block.push(words.integer("entries of a block")?);
        }
        block.push(words.long("entries of a block")?);
        Ok(block)
    }

    /// Nodes of a type of element in a binary file, where one that is not known can't be passed
    /// over.
    pub(super) fn nodes_of(&self, code: i64, nodes: Option<usize>) -> Result<usize, GmshError> {
        nodes.ok_or(GmshError::UnknownType {
            line: self.place,
            code,
            count: 1,
        })
    }

    pub(super) fn not_a_number(&self, word: &str, expected: &'static str) -> GmshError {
        GmshError::NotANumber {
            line: self.place,
            word: word.to_owned(),
            expected,
        }
    }

    /// Refuses fewer entries than needed.
    pub(super) fn count(
        &self,
        what: &'static str,
        found: usize,
        expected: usize,
    ) -> Result<(), GmshError> {
        self.wrong_if(found < expected, what, found, expected)
    }

    /// Refuses more entries than there can be.
    pub(super) fn at_most(
        &self,
        what: &'static str,
        found: usize,
        expected: usize,
    ) -> Result<(), GmshError> {
        self.wrong_if(found > expected, what, found, expected)
    }

    /// Refuses a sum that differs from the one announced.
    pub(super) fn total(
        &self,
        what: &'static str,
        found: usize,
        announced: i64,
    ) -> Result<(), GmshError> {
        let expected = self.size(announced)?;
        self.wrong_if(found != expected, what, found, expected)
    }

    fn wrong_if(
        &self,
        wrong: bool,
        what: &'static str,
        found: usize,
        expected: usize,
    ) -> Result<(), GmshError> {
        if !wrong {
            return Ok(());
        }
        Err(GmshError::Count {
            line: self.place,
            what,
            found,
            expected,
        })
    }

    /// A count or a tag that is not negative.
    pub(super) fn size(&self, number: i64) -> Result<usize, GmshError> {
        usize::try_from(number)
            .map_err(|_| self.not_a_number(&number.to_string(), "a number of entries"))
    }

    /// The next bytes of a binary part.
    fn take<const N: usize>(&mut self, order: Order) -> Result<[u8; N], GmshError> {
        let taken = self.bytes.get(self.at..self.at + N);
        let Some(Ok(mut taken)) = taken.map(<[u8; N]>::try_from) else {
            return Err(GmshError::Short {
                line: Position::Byte(self.at),
                section: self.section.clone(),
            });
        };
        self.at += N;
        if order == Order::Big {
            taken.reverse();
        }
        Ok(taken)
    }
}

impl Words<'_, '_> {
    /// Where the line or the record begins.
    pub(super) fn position(&self) -> Position {
        self.reader.place
    }

    pub(super) fn size(&self, number: i64) -> Result<usize, GmshError> {
        self.reader.size(number)
    }

    /// An integer that is one of 4 bytes in a binary file.
    pub(super) fn integer(&mut self, what: &'static str) -> Result<i64, GmshError> {
        let expected = self.found + 1;
        self.integer_of(what, self.found, expected)
    }

    /// The same as one of several.
    pub(super) fn integer_of(
        &mut self,
        what: &'static str,
        found: usize,
        expected: usize,
    ) -> Result<i64, GmshError> {
        match self.reader.binary {
            Some(order) => self
                .reader
                .take(order)
                .map(|taken| i64::from(i32::from_le_bytes(taken))),
            None => self.number(what, "a whole number", found, expected),
        }
    }

    /// An integer that is one of 8 bytes in a binary file.
    pub(super) fn long(&mut self, what: &'static str) -> Result<i64, GmshError> {
        match self.reader.binary {
            Some(order) => self.reader.take(order).map(i64::from_le_bytes),
            None => self.number(what, "a whole number", self.found, self.found + 1),
        }
    }

    pub(super) fn real(&mut self, what: &'static str) -> Result<f64, GmshError> {
        let value = match self.reader.binary {
            Some(order) => f64::from_le_bytes(self.reader.take(order)?),
            None => self.number(what, "a coordinate", self.found, self.found + 1)?,
        };
        if value.is_finite() {
            return Ok(value);
        }
        Err(self.reader.not_a_number(&value.to_string(), "a coordinate"))
    }

    /// Passes over reals of a binary file; text has them in the same line.
    pub(super) fn skip_reals(&mut self, count: i64) -> Result<(), GmshError> {
        if let Some(order) = self.reader.binary {
            for _ in 0..self.reader.size(count)? {
                self.reader.take::<8>(order)?;
            }
        }
        Ok(())
    }

    fn number<T: std::str::FromStr>(
        &mut self,
        what: &'static str,
        expected_is: &'static str,
        found: usize,
        expected: usize,
    ) -> Result<T, GmshError> {
        let word = self.text.as_mut().and_then(Iterator::next);
        let Some(word) = word else {
            return Err(GmshError::Count {
                line: self.reader.place,
                what,
                found,
                expected,
            });
        };
        self.found += 1;
        let number = word.parse();
        number.map_err(|_| self.reader.not_a_number(&word, expected_is))
    }
}
