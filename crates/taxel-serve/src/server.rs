//! HTTP and WebSocket: the page and its data, for holders of the token only.

use std::net::{IpAddr, SocketAddr};
use std::sync::atomic::Ordering;
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use axum::Router;
use axum::extract::rejection::QueryRejection;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Query, Request as HttpRequest, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use serde::Deserialize;
use subtle::ConstantTimeEq;
use tokio::net::TcpListener;
use tokio::sync::broadcast::error::RecvError;

use crate::connection::Limited;
use crate::foxglove;
use crate::history::{Gathered, HistoryQuery, Reply};
use crate::link::LinkHandle;
use crate::marks::LONGEST_MARK;
use crate::message::{Provenance, SensorNow, Status};
use crate::pump::{Command, NewMark};
use crate::record::Recorder;
use crate::replay::ReplayCommand;
use crate::shared::{POSTS, Shared, StatusNow};
use crate::tare::By;

const INDEX: &str = include_str!("../page/dist/index.html");
const SCRIPT: &str = include_str!("../page/dist/app.js");
const STYLE: &str = include_str!("../page/dist/app.css");

const POLICY: &str = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; \
                      connect-src 'self'; frame-ancestors 'none'; base-uri 'none'";

/// Interval at which each client receives the state of the source.
const STATUS_EVERY: Duration = Duration::from_millis(100);
/// A connection to which nothing could be sent for so long is dropped.
const LONGEST_SILENCE: Duration = Duration::from_secs(30);
/// Messages that a client may be behind before it loses the oldest.
const MOST_BEHIND: usize = 64;
/// Largest command of a client, bytes.
const LARGEST_COMMAND: usize = 4096;

/// State of the routes.
pub(crate) struct Site {
    pub(crate) token: String,
    /// Address on which the service listens.
    pub(crate) address: IpAddr,
    pub(crate) hello: String,
    /// The device to scale, SVG; empty for a recording that describes itself.
    pub(crate) drawing: String,
    /// What turns frames into topics of Foxglove.
    pub(crate) foxglove: foxglove::View,
    pub(crate) provenance: Provenance,
    pub(crate) stale_after: f64,
    /// Folder of recordings that clients begin; `None` where they may not.
    pub(crate) records_to: Option<String>,
    pub(crate) shared: Arc<Shared>,
    pub(crate) commands: mpsc::SyncSender<Command>,
}

#[derive(Debug, Deserialize)]
struct Access {
    #[serde(default)]
    token: String,
}

/// A command of a client, as text.
#[derive(Debug, Deserialize)]
#[serde(tag = "command", rename_all = "snake_case", deny_unknown_fields)]
enum Request {
    Tare {
        #[serde(default)]
        force: bool,
    },
    ClearTare {},
    UndoTare {
        to: u64,
    },
    Mark {
        text: String,
    },
    StartRecording {
        name: String,
    },
    StopRecording {},
    Pause {
        on: bool,
    },
    Step {},
    Seek {
        time_ns: u64,
    },
    Speed {
        speed: f64,
    },
    Loop {
        on: bool,
    },
}

/// One of the sites of a service.
#[derive(Clone)]
struct Served {
    sites: Arc<Vec<Site>>,
    place: usize,
}

impl std::ops::Deref for Served {
    type Target = Site;

    fn deref(&self) -> &Site {
        &self.sites[self.place]
    }
}

/// Where the page of the site at a place is: the first at the root, the second below `/2`.
fn path(place: usize) -> String {
    match place {
        0 => String::new(),
        place => format!("/{}", place + 1),
    }
}

/// The routes of one site.
fn routes(site: Served) -> Router {
    let below = |name: &str| format!("{}/{name}", path(site.place));
    Router::new()
        .route(&below(""), get(index))
        .route(
            &below("app.js"),
            get(|| async { asset("text/javascript; charset=utf-8", SCRIPT) }),
        )
        .route(
            &below("app.css"),
            get(|| async { asset("text/css; charset=utf-8", STYLE) }),
        )
        .route(&below("drawing.svg"), get(drawing))
        .route(&below("history"), get(history))
        .route(&below("ws"), get(socket))
        .route(&below("foxglove"), get(foxglove_socket))
        .layer(from_fn_with_state(site.clone(), own_host))
        .with_state(site)
}

/// Serves until the stop flags are set.
pub(crate) async fn serve(listener: TcpListener, sites: Arc<Vec<Site>>) -> std::io::Result<()> {
    let all = (0..sites.len()).map(|place| Served {
        sites: Arc::clone(&sites),
        place,
    });
    let router = all.map(routes).fold(Router::new(), Router::merge);
    let stopped = async move {
        while sites.iter().any(|site| !site.shared.stopped()) {
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    };
    let limit = LONGEST_SILENCE;
    let listener = Limited { listener, limit };
    axum::serve(listener, router)
        .with_graceful_shutdown(stopped)
        .await
}

impl Site {
    fn admits(&self, access: &Access) -> bool {
        self.token.as_bytes().ct_eq(access.token.as_bytes()).into()
    }
}

/// Refuses requests that name another host: a page elsewhere could have its name point
/// to this machine.
async fn own_host(State(site): State<Served>, request: HttpRequest, next: Next) -> Response {
    let host = request.headers().get(header::HOST);
    let host = host.and_then(|host| host.to_str().ok()).unwrap_or("");
    if is_own(host, site.address) {
        return next.run(request).await;
    }
    let text = "421 this service has another name: open the address that `taxel live` printed\n";
    (StatusCode::MISDIRECTED_REQUEST, text).into_response()
}

/// True if `host`, with or without a port, is a name of this machine or the address `bound`;
/// of a service that listens on all addresses any address.
fn is_own(host: &str, bound: IpAddr) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|byte| byte.is_ascii_digit()) => name,
        _ => host,
    };
    if name.eq_ignore_ascii_case("localhost") {
        return true;
    }
    let bare = name
        .strip_prefix('[')
        .and_then(|name| name.strip_suffix(']'));
    let address: Result<IpAddr, _> = bare.unwrap_or(name).parse();
    address.is_ok_and(|address| address.is_loopback() || address == bound || bound.is_unspecified())
}

fn asset(kind: &'static str, text: &'static str) -> Response {
    let mut response = text.into_response();
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(kind));
    headers.insert(
        header::CONTENT_SECURITY_POLICY,
        HeaderValue::from_static(POLICY),
    );
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    headers.insert(
        header::REFERRER_POLICY,
        HeaderValue::from_static("no-referrer"),
    );
    headers.insert(
        header::X_CONTENT_TYPE_OPTIONS,
        HeaderValue::from_static("nosniff"),
    );
    response
}

async fn drawing(State(site): State<Served>, Query(access): Query<Access>) -> Response {
    if !site.admits(&access) {
        return refused();
    }
    if site.drawing.is_empty() {
        return StatusCode::NOT_FOUND.into_response();
    }
    let kind = HeaderValue::from_static("image/svg+xml");
    ([(header::CONTENT_TYPE, kind)], site.drawing.clone()).into_response()
}

async fn history(
    State(site): State<Served>,
    Query(access): Query<Access>,
    query: Result<Query<HistoryQuery>, QueryRejection>,
) -> Response {
    if !site.admits(&access) {
        return refused();
    }
    // A long answer takes a while to write: other clients must not wait for it.
    let answer = tokio::task::spawn_blocking(move || {
        let Query(query) = query.map_err(|rejection| rejection.body_text())?;
        let gathered = {
            // Always in this order, and briefly: the pump waits for either.
            let (history, events) = (site.shared.history(), site.shared.events());
            Gathered::new(&query, &history, &events)?
        };
        Ok(gathered.write(&site.provenance))
    });
    let answer = answer.await.unwrap_or_else(|error| Err(error.to_string()));
    match answer {
        Ok(Reply::Json(text)) => saved("application/json", None, text),
        // The page gives the file its name, with the time of day.
        Ok(Reply::Csv(text)) => saved("text/csv; charset=utf-8", Some("attachment"), text),
        Err(wrong) => (StatusCode::BAD_REQUEST, format!("400 {wrong}\n")).into_response(),
    }
}

/// A text of the moment, which a browser shall not keep; shown or saved as its disposition says.
fn saved(kind: &'static str, disposition: Option<&'static str>, text: String) -> Response {
    let mut response = text.into_response();
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(kind));
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    let nosniff = HeaderValue::from_static("nosniff");
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, nosniff);
    if let Some(disposition) = disposition {
        let disposition = HeaderValue::from_static(disposition);
        headers.insert(header::CONTENT_DISPOSITION, disposition);
    }
    response
}

fn refused() -> Response {
    let text = "401 wrong token: open the address that `taxel live` printed\n";
    (StatusCode::UNAUTHORIZED, text).into_response()
}

async fn index(State(site): State<Served>, Query(access): Query<Access>) -> Response {
    if site.admits(&access) {
        asset("text/html; charset=utf-8", INDEX)
    } else {
        refused()
    }
}

async fn socket(
    State(site): State<Served>,
    Query(access): Query<Access>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Response {
    if !site.admits(&access) {
        return refused();
    }
    if !same_origin(&headers) {
        let text = "403 this page comes from another site\n";
        return (StatusCode::FORBIDDEN, text).into_response();
    }
    upgrade
        .max_message_size(LARGEST_COMMAND)
        .on_upgrade(|socket| client(socket, site))
}

/// The topics for Foxglove, which is a page of another site or a program: the token alone is the key.
async fn foxglove_socket(
    State(site): State<Served>,
    Query(access): Query<Access>,
    upgrade: WebSocketUpgrade,
) -> Response {
    if !site.admits(&access) {
        return refused();
    }
    upgrade
        .protocols(foxglove::PROTOCOLS)
        .max_message_size(LARGEST_COMMAND)
        .on_upgrade(async move |socket| {
            foxglove::client(
                socket,
                &site.provenance.device,
                &site.foxglove,
                &site.shared,
            )
            .await;
        })
}

/// A browser names the site of its page; programs send no Origin.
fn same_origin(headers: &HeaderMap) -> bool {
    let text = |name| headers.get(name).map(HeaderValue::to_str);
    match (text(header::ORIGIN), text(header::HOST)) {
        (None, _) => true,
        (Some(Ok(origin)), Some(Ok(host))) => {
            origin
                .strip_prefix("http://")
                .or_else(|| origin.strip_prefix("https://"))
                == Some(host)
        }
        _ => false,
    }
}

/// Feeds one client; when it is slow it loses frames, and only it.
async fn client(mut socket: WebSocket, site: Served) {
    let shared = &site.shared;
    shared.clients.fetch_add(1, Ordering::Relaxed);
    let mut messages = shared.messages.subscribe();
    let mut dropped = 0;
    let mut posted = [0; POSTS];
    let mut next_event = 0;
    let mut ticks = tokio::time::interval(STATUS_EVERY);
    ticks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Skip);
    let mut alive = socket
        .send(Message::Text(site.hello.clone().into()))
        .await
        .is_ok();
    let last_frame = shared.status().last_frame.clone();
    if let Some(bytes) = last_frame {
        alive = alive && socket.send(Message::Binary(bytes)).await.is_ok();
    }
    while alive && !shared.stopped() {
        tokio::select! {
            message = messages.recv() => match message {
                // A client that is behind gets what is new.
                Ok(_) if messages.len() > MOST_BEHIND => dropped += 1,
                Ok(outgoing) if outgoing.is_end() => {}
                Ok(outgoing) => {
                    alive = socket.send(Message::Binary(outgoing.bytes)).await.is_ok();
                    // What a client never read was not sent.
                    if alive {
                        shared.sent().push(outgoing.arrival.elapsed().as_secs_f64());
                    }
                }
                Err(RecvError::Lagged(frames)) => dropped += frames,
                Err(RecvError::Closed) => break,
            },
            _ = ticks.tick() => {
                let now = shared.status().clone();
                let new = now.posts.iter().zip(&mut posted).filter(|(post, sent)| post.version != **sent);
                for (post, sent) in new {
                    *sent = post.version;
                    alive = alive && socket.send(Message::Text(post.text.as_ref().into())).await.is_ok();
                }
                let events = shared.events().since(next_event);
                if let Some((text, next)) = events {
                    next_event = next;
                    alive = alive && socket.send(Message::Text(text.into())).await.is_ok();
                }
                let text = status_text(&site, &now, dropped);
                alive = alive && socket.send(Message::Text(text.into())).await.is_ok();
            }
            request = socket.recv() => match request {
                Some(Ok(Message::Text(text))) => obey(&site, &text),
                Some(Ok(Message::Close(_)) | Err(_)) | None => break,
                Some(Ok(_)) => {}
            },
        }
    }
    shared.clients.fetch_sub(1, Ordering::Relaxed);
}

fn obey(site: &Site, text: &str) {
    // What is no command is ignored; so is a command on top of a full queue.
    if let Ok(request) = serde_json::from_str::<Request>(text) {
        let _ = site.commands.try_send(match request {
            Request::Tare { force } => Command::Tare {
                by: By::Page,
                force,
            },
            Request::ClearTare {} => Command::ClearTare,
            Request::UndoTare { to } => Command::UndoTare { to },
            Request::Mark { text } => Command::Mark(NewMark {
                text: text.chars().take(LONGEST_MARK).collect(),
                by: By::Page.name().into(),
                at: None,
            }),
            Request::StartRecording { name } => Command::StartRecording { name },
            Request::StopRecording {} => Command::StopRecording,
            Request::Pause { on } => Command::Replay(ReplayCommand::Pause(on)),
            Request::Step {} => Command::Replay(ReplayCommand::Step),
            Request::Seek { time_ns } => Command::Replay(ReplayCommand::Seek(time_ns)),
            Request::Speed { speed } => Command::Replay(ReplayCommand::Speed(speed)),
            Request::Loop { on } => Command::Replay(ReplayCommand::Loop(on)),
        });
    }
}

/// How each source stands, where there are several.
fn sensors(served: &Served) -> Vec<SensorNow<'_>> {
    let sites = served.sites.iter().enumerate();
    let several = sites.filter(|_| served.sites.len() > 1);
    several
        .map(|(place, site)| {
            let (silent, ended) = {
                let now = site.shared.status();
                (now.last_arrival.elapsed().as_secs_f64(), now.ended)
            };
            SensorNow {
                name: &site.provenance.device,
                path: format!("{}/", path(place)),
                here: place == served.place,
                state: match silent > site.stale_after {
                    _ if ended => "ended",
                    true => "stale",
                    false => "live",
                },
            }
        })
        .collect()
}

fn status_text(site: &Served, now: &StatusNow, dropped: u64) -> String {
    let age_s = Instant::now()
        .saturating_duration_since(now.last_arrival)
        .as_secs_f64();
    let status = Status {
        // Someone who pauses a replay knows why nothing comes.
        stale: age_s > site.stale_after && now.replay.as_ref().is_none_or(|replay| !replay.paused),
        age_s,
        ended: now.ended,
        clients: site.shared.clients.load(Ordering::Relaxed),
        dropped,
        tare: now.tare,
        tare_time_ns: now.tare_time_ns,
        message: &now.notice,
        below_zero: now.below_zero.as_ref(),
        link: site.shared.link.get().map(LinkHandle::now),
        recording: now.recording.as_ref().and_then(Recorder::now),
        records_to: site.records_to.as_deref(),
        replay: now.replay.as_ref(),
        sensors: sensors(site),
    };
    serde_json::to_string(&status).unwrap_or_default()
}

/// Address of the page for people.
pub(crate) fn page_address(address: SocketAddr, token: &str) -> String {
    format!("http://{address}/?token={token}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_own_names_are_answered() {
        let lan: IpAddr = "192.168.7.9".parse().unwrap();
        for host in [
            "localhost:7117",
            "LocalHost",
            "127.0.0.1:80",
            "[::1]:7117",
            "192.168.7.9:1",
        ] {
            assert!(is_own(host, lan), "{host}");
        }
        for host in [
            "",
            "evil.example",
            "evil.example:7117",
            "127.0.0.1.evil.example",
            "10.0.0.1",
        ] {
            assert!(!is_own(host, lan), "{host}");
        }
        assert!(is_own("10.0.0.1:7117", "0.0.0.0".parse().unwrap()));
        assert!(!is_own("evil.example", "0.0.0.0".parse().unwrap()));
    }
}
