//! Links against virtual devices: what is sent arrives, and what comes back is found again.
#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a panic is how a test fails, and figures are printed"
)]

mod common;

use std::io::Write as _;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use common::{Playing, link, missing, numbers, observed, temporary};
use taxel_serve::device::DevicePlace;
use taxel_serve::link::{LinkOptions, LinkState, Reconnect};
use taxel_serve::{Next, Source as _};

fn tcp() -> DevicePlace {
    DevicePlace::Tcp("127.0.0.1:0".into())
}

#[test]
fn nothing_is_lost_over_a_terminal_and_over_tcp() {
    for place in [DevicePlace::Terminal(None), tcp()] {
        let device = Playing::start(place, 16, 1000.0, "", None, None);
        let address = match device.name.strip_prefix('/') {
            Some(_) => format!("serial:{}", device.name),
            None => device.name.clone(),
        };
        let (options, states) = observed();
        let mut source = link(&address, 16, 1000.0, options);
        let found = numbers(&mut source, |found| found.len() >= 1500);
        assert_eq!((found.len(), missing(&found)), (1500, 0), "{address}");
        let status = source.status().now();
        assert_eq!(
            (status.state, status.connects, status.overrun),
            (LinkState::InStep, 1, 0)
        );
        assert!(status.bytes >= 1500 * 88);
        drop(source);
        device.stop();
        assert_eq!(
            states.names(),
            [LinkState::Connected, LinkState::InStep, LinkState::Ended]
        );
    }
}

/// A port that is pulled out and plugged in again so often, and how long each return took, s.
fn replugged(cycles: usize, name: &str) -> Vec<f64> {
    let away = 0.1;
    let times: Vec<String> = (0..cycles)
        .map(|i| {
            format!(
                "{{ at = \"{} s\", for = \"{away} s\" }}",
                0.3 + 0.4 * i as f64
            )
        })
        .collect();
    let faults = format!("[link]\nleave = [{}]\n", times.join(", "));
    let port = temporary(name);
    let place = DevicePlace::Terminal(Some(port.clone()));
    let device = Playing::start(place, 4, 500.0, &faults, None, None);
    let (options, states) = observed();
    let mut source = link(
        &format!("serial:{}", port.to_str().unwrap()),
        4,
        500.0,
        options,
    );
    let mut reconnects = 0;
    let end = Instant::now() + Duration::from_secs_f64(1.5 + 0.4 * cycles as f64);
    let (mut before, mut flat) = (None, Vec::new());
    while Instant::now() < end {
        if source.next().unwrap() == Next::Reconnected {
            reconnects += 1;
            let now = open_files_and_threads();
            flat.push(now);
            before.get_or_insert(now);
        }
    }
    assert_eq!(source.status().state(), LinkState::InStep);
    // On a busy machine two of them can fall into one stall of this process.
    assert!(
        (cycles - 1 - cycles / 100..=cycles).contains(&reconnects),
        "{reconnects}"
    );
    // Other tests run in this process: only growth with the cycles counts.
    if cycles > 100 {
        println!(
            "descriptors and threads: {before:?} at first, {:?} at last",
            flat.last()
        );
        assert_eq!(before, flat.last().copied());
    }
    drop(source);
    device.stop();
    assert!(
        !port.exists(),
        "the link of the port is gone with the device"
    );
    let (mut gone, mut open) = (None, true);
    let mut took = Vec::new();
    for status in states.all() {
        match status.state {
            LinkState::Absent if open => (gone, open) = (Some(status.since_ns), false),
            LinkState::Connected => open = true,
            LinkState::InStep => took.extend(
                gone.take()
                    .map(|gone| (status.since_ns - gone) as f64 * 1e-9 - away),
            ),
            _ => {}
        }
    }
    // On a busy machine the next cycle can come before the first frame.
    assert!(
        took.len() * 20 >= reconnects * 19,
        "{} of {reconnects}",
        took.len()
    );
    took
}

fn open_files_and_threads() -> [usize; 2] {
    ["fd", "task"]
        .map(|kind| std::fs::read_dir(format!("/proc/self/{kind}")).map_or(0, Iterator::count))
}

#[test]
fn a_port_that_comes_back_is_in_step_within_a_second() {
    for took in replugged(6, "replug") {
        assert!(took < 1.0, "{took} s");
    }
}

/// Run alone: `cargo test --release -p taxel-serve --test links -- --ignored --nocapture replug`.
#[test]
#[ignore = "seven minutes; run alone, since it counts descriptors and threads"]
fn a_thousand_replugs_leak_nothing() {
    let mut took = replugged(1000, "replug-1000");
    took.sort_by(f64::total_cmp);
    let longest = took.last().unwrap();
    println!(
        "back in step: median {:.3} s, longest {longest:.3} s",
        took[took.len() / 2]
    );
    assert!(*longest < 1.0);
}

#[test]
fn a_board_that_sends_nonsense_is_garbled_and_one_that_hangs_is_silent() {
    let faults = "[link]\nwrong_baud = true\n";
    let device = Playing::start(DevicePlace::Terminal(None), 4, 200.0, faults, None, None);
    let (options, _) = observed();
    let mut source = link(&format!("serial:{}", device.name), 4, 200.0, options);
    let deadline = Instant::now() + Duration::from_secs(10);
    while source.status().state() != LinkState::Garbled && Instant::now() < deadline {
        assert!(matches!(source.next().unwrap(), Next::Nothing(_)));
    }
    let status = source.status().now();
    assert!(
        status.reason.contains("wrong baud rate"),
        "{}",
        status.reason
    );
    drop(source);
    device.stop();

    let faults =
        "[link]\nstuck = { at = \"500 ms\" }\nbanner = \"Ready\\r\\n\"\nhalf_packet_first = true\n";
    let device = Playing::start(tcp(), 4, 200.0, faults, None, None);
    let (options, states) = observed();
    let mut source = link(&device.name, 4, 200.0, options);
    while source.status().state() != LinkState::Silent && Instant::now() < deadline {
        source.next().unwrap();
    }
    assert_eq!(
        states.names(),
        [LinkState::Connected, LinkState::InStep, LinkState::Silent]
    );
    // The text and the end of the first packet.
    assert_eq!(source.status().now().wire.passed_over_bytes, 7 + 20);
    drop(source);
    device.stop();
}

#[test]
fn a_connection_that_is_lost_ends_the_run_on_request() {
    let faults = "[link]\nleave = [{ at = \"300 ms\", for = \"1 s\" }]\n";
    let device = Playing::start(tcp(), 4, 200.0, faults, None, None);
    let options = LinkOptions {
        reconnect: Reconnect::Once,
        ..LinkOptions::default()
    };
    let mut source = link(&device.name, 4, 200.0, options);
    let error = loop {
        match source.next() {
            Ok(_) => {}
            Err(error) => break error.to_string(),
        }
    };
    assert!(error.contains("--once"), "{error}");
    device.stop();
}

#[test]
fn what_is_absent_is_waited_for_with_the_reason() {
    let (options, states) = observed();
    let source = link("serial:/dev/taxel-no-such-port", 4, 200.0, options);
    let deadline = Instant::now() + Duration::from_secs(5);
    while states.all().is_empty() && Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(5));
    }
    let status = source.status().now();
    assert_eq!(status.state, LinkState::Absent);
    assert!(status.reason.contains("taxel devices"), "{}", status.reason);
}

/// The bytes of so many frames, in a file.
fn recorded(frames: u64, name: &str) -> std::path::PathBuf {
    use taxel_serve::device::Encode as _;
    let path = temporary(name);
    let mut bytes = Vec::new();
    (0..frames).for_each(|n| common::Encoder.encode(&common::frame(n, 4), &mut bytes));
    std::fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn a_program_is_read_to_its_end_and_its_words_are_passed_on() {
    let path = recorded(100, "program");
    let heard = Arc::new(Mutex::new(Vec::<String>::new()));
    let tell = Arc::clone(&heard);
    let options = LinkOptions {
        tell: Arc::new(move |line| tell.lock().unwrap().push(line.into())),
        ..LinkOptions::default()
    };
    let command = format!(
        "exec:sh -c 'cat {}; echo hello >&2'",
        path.to_str().unwrap()
    );
    let mut source = link(&command, 4, 200.0, options);
    let found = numbers(&mut source, |_| false);
    assert_eq!(found, (0..100).collect::<Vec<_>>());
    drop(source);
    std::thread::sleep(Duration::from_millis(50));
    let heard = heard.lock().unwrap().clone();
    assert!(heard.contains(&"sh: hello".to_owned()), "{heard:?}");
    std::fs::remove_file(path).unwrap();
}

#[test]
fn a_program_that_fails_is_started_again_and_one_that_will_not_end_is_killed() {
    let path = recorded(10, "again");
    let (options, states) = observed();
    let command = format!("exec:sh -c 'cat {}; exit 3'", path.to_str().unwrap());
    let mut source = link(&command, 4, 200.0, options);
    numbers(&mut source, |found| found.len() == 30);
    drop(source);
    let reasons: Vec<_> = states
        .all()
        .into_iter()
        .map(|status| status.reason)
        .collect();
    assert!(
        reasons.iter().any(|reason| reason.contains('3')),
        "{reasons:?}"
    );
    std::fs::remove_file(path).unwrap();

    let (options, _) = observed();
    let stubborn = "exec:sh -c \"trap '' TERM; echo x; while true; do sleep 0.05; done\"";
    let source = link(stubborn, 4, 200.0, options);
    let deadline = Instant::now() + Duration::from_secs(5);
    while source.status().now().bytes == 0 && Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(5));
    }
    let begin = Instant::now();
    drop(source);
    let took = begin.elapsed().as_secs_f64();
    assert!((1.9..3.0).contains(&took), "{took}");
}

#[test]
fn a_program_that_does_not_exist_ends_the_run() {
    let mut source = link("exec:/no/such/program", 4, 200.0, LinkOptions::default());
    let error = loop {
        match source.next() {
            Ok(_) => {}
            Err(error) => break error.to_string(),
        }
    };
    assert!(error.contains("cannot be started"), "{error}");
}

#[test]
fn a_named_pipe_is_read_once() {
    let path = temporary("fifo");
    let made = std::process::Command::new("mkfifo").arg(&path).status();
    assert!(made.unwrap().success());
    let bytes = recorded(50, "fifo-bytes");
    let (writer_path, content) = (path.clone(), std::fs::read(&bytes).unwrap());
    let writer = std::thread::spawn(move || {
        let mut pipe = std::fs::OpenOptions::new()
            .write(true)
            .open(writer_path)
            .unwrap();
        pipe.write_all(&content).unwrap();
    });
    let mut source = link(&path.to_string_lossy(), 4, 200.0, LinkOptions::default());
    assert_eq!(numbers(&mut source, |_| false).len(), 50);
    writer.join().unwrap();
    for path in [path, bytes] {
        std::fs::remove_file(path).unwrap();
    }
}

#[test]
fn datagrams_arrive() {
    let free = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = free.local_addr().unwrap().port();
    drop(free);
    let mut source = link(&format!("udp:{port}"), 4, 200.0, LinkOptions::default());
    let place = DevicePlace::Udp(format!("127.0.0.1:{port}"));
    let device = Playing::start(place, 4, 200.0, "", None, None);
    let found = numbers(&mut source, |found| found.len() >= 100);
    assert_eq!(missing(&found), 0);
    device.stop();
}

#[test]
fn the_truth_says_what_was_done_to_each_frame() {
    let truth = temporary("truth");
    let faults = "[frames]\nlose = 0.05\nrepeat = 0.02\nswap = 0.02\n[wire]\nflip = 2e-4\n";
    let device = Playing::start(tcp(), 4, 1000.0, faults, Some(2000), Some(truth.clone()));
    let mut source = link(&device.name, 4, 1000.0, LinkOptions::default());
    let found = numbers(&mut source, |found| found.iter().any(|n| *n >= 1990));
    let summary = device.stop();
    drop(source);
    let text = std::fs::read_to_string(&truth).unwrap();
    let lines: Vec<serde_json::Value> = text
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert!(lines.len() >= 1900 && summary.damaged > 4, "{summary:?}");
    let whole: std::collections::BTreeSet<u64> = lines
        .iter()
        .filter(|line| line["sent_s"].is_number() && line["flipped"] == 0)
        .map(|line| line["sequence"].as_u64().unwrap())
        .filter(|n| *n < 1990)
        .collect();
    let found: std::collections::BTreeSet<u64> = found.into_iter().filter(|n| *n < 1990).collect();
    // After damage the search goes on at the next byte: no packet beside it is lost.
    assert_eq!(found, whole);
    std::fs::remove_file(truth).unwrap();
}

/// A server whose connections each get `say`, and the address of it.
fn web_socket_server(
    connections: usize,
    say: impl Fn(&mut tungstenite::WebSocket<std::net::TcpStream>, usize) + Send + 'static,
) -> String {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("ws:{}/", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        for connection in 0..connections {
            let (stream, _) = listener.accept().unwrap();
            let mut socket = tungstenite::accept(stream).unwrap();
            say(&mut socket, connection);
            // To the end of the talk.
            let _ = socket.close(None);
            while socket.read().is_ok() {}
        }
    });
    address
}

/// The server of XELA: a welcome, objects as text and as bytes, and a connection that is lost.
#[test]
fn a_web_socket_server_is_read_and_found_again() {
    use tungstenite::Message;
    let object = |n: usize| {
        format!(r#"{{"message":{n},"1":{{"time":{n}.5,"taxels":1,"data":"81F6,79D0,753C"}}}}"#)
    };
    let address = web_socket_server(2, move |socket, connection| {
        let welcome = r#"{"message":"Welcome"}"#;
        socket.send(Message::text(welcome)).unwrap();
        for n in 0..20 {
            let object = object(100 * connection + n);
            let message = match n % 3 {
                0 => Message::binary(object.into_bytes()),
                _ => Message::text(object),
            };
            socket.send(message).unwrap();
            socket.send(Message::Ping(vec![1].into())).unwrap();
        }
    });
    let board = taxel_board::Board::shipped("xela-server").unwrap();
    let address = taxel_serve::link::LinkAddress::parse(&address).unwrap();
    let decoder = Box::new(taxel_serve::BoardDecoder::new(&board, &address));
    let (options, states) = observed();
    let mut source =
        taxel_serve::LinkSource::start(address, board.stream(), decoder, options).unwrap();
    let deadline = Instant::now() + Duration::from_secs(20);
    let (mut frames, mut reconnects) = (0, 0);
    while frames < 40 && Instant::now() < deadline {
        match source.next().unwrap() {
            Next::Frame(frame) => {
                assert_eq!(frame.values[..3], [33270.0, 31184.0, 30012.0]);
                frames += 1;
            }
            Next::Reconnected => reconnects += 1,
            _ => {}
        }
    }
    let wire = source.status().now().wire;
    assert_eq!((frames, reconnects), (40, 1), "{:?}", states.all());
    assert_eq!(
        (wire.damaged, wire.other, wire.lost),
        (0, 2, Some(0)),
        "{wire:?}"
    );
}

#[test]
fn a_message_without_bounds_ends_the_connection() {
    let address = web_socket_server(1, |socket, _| {
        // The other side closes before all of it is taken.
        let _ = socket.send(tungstenite::Message::binary(vec![b'{'; 8 << 20]));
    });
    let options = LinkOptions {
        reconnect: Reconnect::Once,
        ..LinkOptions::default()
    };
    let mut source = link(&address, 4, 200.0, options);
    let deadline = Instant::now() + Duration::from_secs(20);
    let error = loop {
        match source.next() {
            Ok(_) => assert!(Instant::now() < deadline),
            Err(error) => break error.to_string(),
        }
    };
    assert!(
        error.contains("too long") || error.contains("too big"),
        "{error}"
    );
}
