//! The WebSocket of Foxglove: the run as topics whose types Foxglove shows by itself.

mod view;

use std::collections::BTreeMap;
use std::sync::Arc;

use axum::extract::ws::{Message, WebSocket};
use serde::Deserialize;
use taxel::estimation::Meaning;
use taxel_recording::mcap::Companion;
use tokio::sync::broadcast::error::RecvError;

use crate::clock::Epoch;
use crate::outgoing::Outgoing;
use crate::shared::Shared;

use view::Topic;
pub(crate) use view::View;

/// Names of the protocol: that of today and the one before, whose messages are the same here.
pub(crate) const PROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];
/// Messages that a client may be behind before it loses the oldest.
const MOST_BEHIND: usize = 64;
/// Subscriptions of one client: several panels may show each topic.
const MOST_SUBSCRIPTIONS: usize = 256;
/// Code of a message with data.
const DATA: u8 = 1;

/// What a client asks for.
#[derive(Debug, Deserialize)]
#[serde(tag = "op", rename_all = "camelCase")]
enum Request {
    Subscribe {
        subscriptions: Vec<Subscription>,
    },
    #[serde(rename_all = "camelCase")]
    Unsubscribe {
        subscription_ids: Vec<u32>,
    },
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Subscription {
    id: u32,
    channel_id: u32,
}

/// Messages of the types of Foxglove for each touch of a recording: force and state of the taxels, an image, arrows with
/// contacts, and the frame of the sensor.
pub fn foxglove_messages(meaning: &Meaning) -> Arc<dyn Companion> {
    Arc::new(View::new(meaning))
}

/// Feeds one client; when it is slow it loses messages, and only it.
pub(crate) async fn client(mut socket: WebSocket, name: &str, view: &View, shared: &Shared) {
    let mut messages = shared.messages.subscribe();
    let mut subscribed: BTreeMap<u32, Topic> = BTreeMap::new();
    let mut next_event = 0;
    for text in [server_info(name), view.advertised()] {
        if socket.send(Message::Text(text.into())).await.is_err() {
            return;
        }
    }
    while !shared.stopped() {
        tokio::select! {
            message = messages.recv() => match message {
                // A client that is behind gets what is new.
                Ok(_) if messages.len() > MOST_BEHIND => {}
                Ok(outgoing) if outgoing.is_end() => {}
                Ok(outgoing) => {
                    let utc_ns = utc_ns(&outgoing);
                    let (events, next) = shared.events().newer(next_event);
                    next_event = next;
                    for (id, topic) in &subscribed {
                        let texts = view.messages(*topic, &outgoing.bytes, utc_ns, &events);
                        for text in texts {
                            let message = Message::Binary(data(*id, utc_ns, &text).into());
                            if socket.send(message).await.is_err() {
                                return;
                            }
                        }
                    }
                }
                Err(RecvError::Lagged(_)) => {}
                Err(RecvError::Closed) => return,
            },
            request = socket.recv() => match request {
                Some(Ok(Message::Text(text))) => obey(&text, &mut subscribed),
                Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                Some(Ok(_)) => {}
            },
        }
    }
}

/// UTC at which a frame arrived, ns since 1970.
fn utc_ns(outgoing: &Outgoing) -> u64 {
    let age = u64::try_from(outgoing.arrival.elapsed().as_nanos()).unwrap_or(0);
    Epoch::of_process().utc_ns().saturating_sub(age)
}

fn server_info(name: &str) -> String {
    let info = serde_json::json!({
        "op": "serverInfo",
        "name": format!("taxel: {name}"),
        "capabilities": [],
        "supportedEncodings": ["json"],
        "metadata": {},
    });
    info.to_string()
}

fn data(subscription: u32, utc_ns: u64, text: &str) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(13 + text.len());
    bytes.push(DATA);
    bytes.extend(subscription.to_le_bytes());
    bytes.extend(utc_ns.to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes
}

/// What is no request is ignored.
fn obey(text: &str, subscribed: &mut BTreeMap<u32, Topic>) {
    match serde_json::from_str(text) {
        Ok(Request::Subscribe { subscriptions }) => {
            for Subscription { id, channel_id } in subscriptions {
                if let Some(topic) = Topic::of_channel(channel_id)
                    && subscribed.len() < MOST_SUBSCRIPTIONS
                {
                    subscribed.insert(id, topic);
                }
            }
        }
        Ok(Request::Unsubscribe { subscription_ids }) => {
            for id in subscription_ids {
                subscribed.remove(&id);
            }
        }
        Err(_) => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subscriptions_come_and_go() {
        let mut subscribed = BTreeMap::new();
        obey(
            r#"{"op":"subscribe","subscriptions":[{"id":7,"channelId":1},{"id":8,"channelId":99}]}"#,
            &mut subscribed,
        );
        assert_eq!(subscribed, BTreeMap::from([(7, Topic::Frame)]));
        obey("no request", &mut subscribed);
        assert_eq!(data(7, 258, "{}"), b"\x01\x07\0\0\0\x02\x01\0\0\0\0\0\0{}");
        obey(
            r#"{"op":"unsubscribe","subscriptionIds":[7]}"#,
            &mut subscribed,
        );
        assert!(subscribed.is_empty());
    }
}
