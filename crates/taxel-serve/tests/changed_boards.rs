//! Boards that come back as others, and others that send to the port of a board.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod common;

use std::io::{Read as _, Write as _};
use std::net::{TcpListener, UdpSocket};
use std::time::{Duration, Instant};

use common::{Encoder, frame, link, observed};
use taxel_board::{Board, Encoder as BoardEncoder, board_file_of_hello};
use taxel_recording::Frame;
use taxel_serve::device::Encode as _;
use taxel_serve::link::{LinkAddress, LinkState};
use taxel_serve::{BoardDecoder, LinkSource, Next, Source as _};

/// A board that says this scale in its hello.
fn of_scale(scale: &str) -> Board {
    let field =
        format!(r#"{{"is":"value","name":"f.{{x,z}}","type":"i16","scale":{scale},"unit":"N"}}"#);
    let hello = format!(r#"{{"name":"board","fields":[{field}]}}"#);
    Board::parse("hello", &board_file_of_hello(&hello).unwrap()).unwrap()
}

/// Bytes of ten frames in which each value is one.
fn ten(board: &Board) -> Vec<u8> {
    let mut bytes = Vec::new();
    for sequence in 0..10 {
        let frame = Frame {
            sequence,
            time_ns: sequence * 10_000_000,
            values: vec![1.0, 1.0],
            ..Frame::default()
        };
        BoardEncoder::new(board).encode(&frame, &mut bytes);
    }
    bytes
}

/// What comes over a link to a board that goes after ten frames and comes back as `then`: the
/// frames, and why it ended; ten frames of the second connection come before its hello.
fn comes_back_as(then: Board) -> (Vec<Frame>, Option<String>) {
    let first = of_scale("0.01");
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tcp:{}", server.local_addr().unwrap());
    let board = first.clone();
    std::thread::spawn(move || {
        let (mut client, _) = server.accept().unwrap();
        client.write_all(&first.hello().unwrap()).unwrap();
        client.write_all(&ten(&first)).unwrap();
        drop(client);
        let (mut client, _) = server.accept().unwrap();
        client.write_all(&ten(&then)).unwrap();
        let mut question = [0];
        client.read_exact(&mut question).unwrap();
        assert_eq!(question, *b"?");
        client.write_all(&then.hello().unwrap()).unwrap();
        client.write_all(&ten(&then)).unwrap();
        // It stays until the other side goes.
        let _ = client.read_to_end(&mut Vec::new());
    });
    let address = LinkAddress::parse(&address).unwrap();
    let decoder = Box::new(BoardDecoder::new(&board, &address));
    let (options, states) = observed();
    let mut source = LinkSource::start(address, board.stream(), decoder, options).unwrap();
    let deadline = Instant::now() + Duration::from_secs(20);
    let mut frames = Vec::new();
    while frames.len() < 20 && Instant::now() < deadline {
        match source.next() {
            Ok(Next::Frame(frame)) => frames.push(frame),
            Ok(Next::End) => break,
            Ok(_) => {}
            Err(error) => {
                assert_eq!(states.names().last(), Some(&LinkState::Ended));
                return (frames, Some(error.to_string()));
            }
        }
    }
    (frames, None)
}

#[test]
fn a_board_that_comes_back_as_another_ends_the_run() {
    let (frames, error) = comes_back_as(of_scale("1.0"));
    assert_eq!(frames.len(), 10);
    let error = error.unwrap();
    assert!(error.contains("the board has changed"), "{error}");
    assert!(error.contains("start again"), "{error}");
}

#[test]
fn a_board_that_comes_back_is_read_from_its_hello_on() {
    let (frames, error) = comes_back_as(of_scale("0.01"));
    assert_eq!((frames.len(), error), (20, None));
    assert!(frames.iter().all(|frame| frame.values == [1.0, 1.0]));
}

/// A board at a UDP port, and others that send to it too.
#[test]
fn one_board_is_read_at_a_port_and_others_are_named() {
    let port = {
        let free = UdpSocket::bind("127.0.0.1:0").unwrap();
        free.local_addr().unwrap().port()
    };
    let (options, _) = observed();
    let mut source = link(&format!("udp:{port}"), 4, 1000.0, options);
    let [board, other] = [(); 2].map(|()| UdpSocket::bind("127.0.0.1:0").unwrap());
    let names = [&board, &other].map(|socket| socket.local_addr().unwrap());
    let (end, ends) = std::sync::mpsc::channel::<()>();
    let sending = std::thread::spawn(move || {
        let mut wire = Vec::new();
        for sequence in 0.. {
            Encoder.encode(&frame(sequence, 4), &mut wire);
            board.send_to(&wire, ("127.0.0.1", port)).unwrap();
            wire.clear();
            other.send_to(&[0x41], ("127.0.0.1", port)).unwrap();
            if ends.recv_timeout(Duration::from_millis(1)) != Err(TIMEOUT) {
                return (other, sequence);
            }
        }
        unreachable!("the numbers do not end")
    });
    let found = common::numbers(&mut source, |found| found.len() >= 300);
    assert_eq!(common::missing(&found), 0);
    let status = source.status().now();
    assert_eq!(status.wire.passed_over_bytes, 0);
    assert!(status.others.datagrams >= 250, "{:?}", status.others);
    assert_eq!(status.others.senders, [names[1]]);
    // The board goes: the other one may be it, at another port of its own.
    drop(end);
    let (other, last) = sending.join().unwrap();
    let sending = std::thread::spawn(move || {
        let mut wire = Vec::new();
        for sequence in last + 1..last + 3000 {
            Encoder.encode(&frame(sequence, 4), &mut wire);
            other.send_to(&wire, ("127.0.0.1", port)).unwrap();
            wire.clear();
            std::thread::sleep(Duration::from_millis(2));
        }
    });
    let found = common::numbers(&mut source, |found| {
        found.last().is_some_and(|number| *number > last + 10)
    });
    assert!(found.last().is_some_and(|number| *number > last + 10));
    assert_eq!(source.status().now().connects, 2);
    sending.join().unwrap();
}

const TIMEOUT: std::sync::mpsc::RecvTimeoutError = std::sync::mpsc::RecvTimeoutError::Timeout;
