//! Marks from the standard input: one line each.

use std::io::{BufRead, Read as _};
use std::sync::mpsc::SyncSender;

use super::cut;
use crate::pump::{Command, NewMark};

/// Longest line that is read at once, bytes.
const LONGEST_LINE: u64 = 4096;

/// Hands each line on as a mark, in a thread that ends with the input.
pub(crate) fn listen(input: impl BufRead + Send + 'static, commands: SyncSender<Command>) {
    std::thread::spawn(move || lines(input, &commands));
}

fn lines(mut input: impl BufRead, commands: &SyncSender<Command>) {
    let mut line = Vec::new();
    loop {
        line.clear();
        let read = input
            .by_ref()
            .take(LONGEST_LINE)
            .read_until(b'\n', &mut line);
        if !matches!(read, Ok(1..)) {
            return;
        }
        let text = String::from_utf8_lossy(&line);
        let mark = NewMark {
            text: cut(&text),
            by: "standard input".into(),
            at: None,
        };
        if !mark.text.is_empty() && commands.send(Command::Mark(mark)).is_err() {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_line_is_a_mark() {
        let (sender, commands) = std::sync::mpsc::sync_channel(8);
        lines(&b"grasp begins\r\n\n  second  \nlast"[..], &sender);
        drop(sender);
        let texts: Vec<_> = commands
            .iter()
            .map(|command| match command {
                Command::Mark(mark) => mark.text,
                other => panic!("{other:?}"),
            })
            .collect();
        assert_eq!(texts, ["grasp begins", "second", "last"]);
    }
}
