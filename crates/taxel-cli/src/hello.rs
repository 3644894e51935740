//! Boards that say themselves what their frames hold (taxel-wire-1).

use std::fs::File;
use std::io::Read as _;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use taxel::acquisition::Stream;
use taxel_board::{Board, HELLO_QUESTION, HelloFinder, board_file_of_hello, hello_of_channels};
use taxel_serve::link::{Heard, LinkAddress, LinkError, Reconnect};
use taxel_serve::serial_settings;

use crate::Stop;
use crate::boards::{self, NamedBoard};

/// The shipped board that is asked where none is named.
const WIRE: &str = "taxel-wire-1";
/// Longest wait for a hello: it comes once a second until it is asked for.
const PATIENCE: Duration = Duration::from_secs(3);
/// Time between attempts to open a link.
const AGAIN: Duration = Duration::from_millis(500);
/// Beginning of a file in which a hello is looked for, bytes.
const SEARCHED: u64 = 1 << 20;

/// The board that is named, or that answers at `source`; and the link over which it did.
pub(crate) fn board(
    named: Option<&Path>,
    source: &str,
    address: &LinkAddress,
    reconnect: Reconnect,
) -> Result<(NamedBoard, Option<Heard>), Stop> {
    let asked = boards::board(named.unwrap_or(Path::new(WIRE)))?;
    if !asked.board.says_hello() {
        return Ok((asked, None));
    }
    let unknown = |why: &str| {
        Stop::WrongInput(format!(
            "--source {source}: what its bytes mean is not known, and {why}; give --board with a board file or a shipped board: {}",
            boards::shipped()
        ))
    };
    let mut told = false;
    let (hello, heard) = loop {
        match listen(&asked.board, address) {
            Ok(found) => break found,
            Err(LinkError::Open { name, reason }) if named.is_some() => {
                if reconnect == Reconnect::Once {
                    return Err(Stop::Failed(format!("{name}: {reason}")));
                }
                if !std::mem::replace(&mut told, true) {
                    note!("{name}: {reason}; trying again");
                }
                std::thread::sleep(AGAIN);
            }
            Err(error) if named.is_none() => {
                return Err(unknown(&format!("it cannot be asked: {error}")));
            }
            Err(error) => return Err(Stop::WrongInput(error.to_string())),
        }
    };
    let Some(hello) = hello else {
        let seconds = PATIENCE.as_secs();
        if named.is_none() {
            return Err(unknown(&format!("no hello of {WIRE} came in {seconds} s")));
        }
        note!(
            "no hello came in {seconds} s: the frames hold what {} says",
            asked.name
        );
        return Ok((asked, Some(heard)));
    };
    Ok((as_said(asked, &hello, source)?, Some(heard)))
}

/// The board as a hello in the bytes of a file says, if it says hello and there is one.
pub(crate) fn recorded(named: NamedBoard, path: &Path) -> Result<NamedBoard, Stop> {
    let Ok(file) = File::open(path) else {
        return Ok(named);
    };
    let mut bytes = Vec::new();
    let read = file.take(SEARCHED).read_to_end(&mut bytes);
    let mut piece = read.is_ok().then_some(bytes);
    in_pieces(named, &path.to_string_lossy(), || Ok(piece.take()))
}

/// The same of bytes that come in pieces, of which no more are asked for than needed.
pub(crate) fn in_pieces(
    named: NamedBoard,
    source: &str,
    mut next: impl FnMut() -> Result<Option<Vec<u8>>, Stop>,
) -> Result<NamedBoard, Stop> {
    let (mut finder, mut left) = (HelloFinder::default(), SEARCHED);
    while named.board.says_hello() && left > 0 {
        let Some(bytes) = next()? else { break };
        left = left.saturating_sub(bytes.len() as u64);
        if let Some(hello) = finder.push(&bytes) {
            return as_said(named, &hello, source);
        }
    }
    Ok(named)
}

/// The board that `hello` describes, with the link of `asked`.
fn as_said(asked: NamedBoard, hello: &str, source: &str) -> Result<NamedBoard, Stop> {
    let text = board_file_of_hello(hello)
        .map_err(|message| Stop::WrongInput(format!("{source}: {message}")))?;
    let mut board = Board::parse("hello of the board", &text)?;
    board.link = asked.board.link;
    note!(
        "the board says: {}, {} values",
        board.name,
        board.values().len()
    );
    let name = asked.name;
    Ok(NamedBoard { name, board, text })
}

/// The hello that comes, if one does, and the link over which it was listened for.
fn listen(board: &Board, address: &LinkAddress) -> Result<(Option<String>, Heard), LinkError> {
    let tell: Arc<dyn Fn(&str) + Send + Sync> = Arc::new(|line| note!("{line}"));
    let (mut finder, mut hello) = (HelloFinder::default(), None);
    let mut found = |bytes: &[u8]| {
        hello = finder.push(bytes);
        hello.is_some()
    };
    let heard = Heard::listen(
        address.clone(),
        serial_settings(board),
        &tell,
        HELLO_QUESTION,
        PATIENCE,
        &mut found,
    )?;
    Ok((hello, heard))
}

/// The board of a virtual device: one that says hello has the channels of what is played.
pub(crate) fn with_channels(named: NamedBoard, stream: &Stream) -> Result<NamedBoard, Stop> {
    let channels = stream.channels();
    if !named.board.says_hello() || named.board.names().count() == channels {
        return Ok(named);
    }
    let rate = named.board.rate.or(stream.period.map(f64::recip));
    let name = format!("{WIRE}, {channels} channels");
    let hello = hello_of_channels(&name, rate, channels, &stream.unit.symbol);
    let text = board_file_of_hello(&hello).map_err(Stop::WrongInput)?;
    let board = Board::parse(&named.name, &text)?;
    let name = named.name;
    Ok(NamedBoard { name, board, text })
}
